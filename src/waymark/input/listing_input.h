// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>

#include "waymark/input/input.h"
#include "waymark/input/listing.h"
#include "waymark/input/reading.h"

namespace waymark {

/// Reads the image files of a listing one frame after the other.
class ListingInput : public Input {
 public:
  /// Reads the first image to learn sizes and to check them against the calibration. Throws
  /// InputError.
  ListingInput(const std::filesystem::path& path, Listing listing, const InputOptions& options);

  const InputInfo& info() const override { return info_; }
  std::optional<InputFrame> next() override;
  bool can_decode_apart() const override { return true; }
  std::optional<Decoding> next_decoding() override;
  void complete(InputFrame& frame) override;

 private:
  InputFrame decode(std::size_t index) const;
  void decode_rest(const ListedFrame& listed, InputFrame& frame) const;
  FrameFault read_images(const ListedFrame& listed, InputFrame& frame) const;
  std::string describe_camera(std::size_t camera) const;
  void read_depth(const ListedFrame& listed, InputFrame& frame) const;
  void find_levels();
  std::size_t find_first_readable() const;
  void check_first_frame(std::size_t index);
  void check_first_depth();
  void describe(const std::filesystem::path& path, const InputOptions& options);

  Listing listing_;
  FrameSelection selection_;
  MaskSource masks_;
  Levels levels_;
  bool has_jpeg_;
  bool has_right_jpeg_;
  std::optional<std::filesystem::path> names_from_;  ///< Nothing: frames have no names.
  InputInfo info_;
  std::vector<ImageSize> sizes_;  ///< Expected, per camera; empty until known.
  ImageSize depth_size_;          ///< Of depth images, as they are in their files.
  std::size_t num_read_ = 0;
  bool has_begun_ = false;  ///< A frame that was whole was given.
};

}  // namespace waymark

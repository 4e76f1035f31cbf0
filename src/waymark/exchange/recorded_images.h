// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "waymark/exchange/export_frames.h"
#include "waymark/input/input.h"
#include "waymark/mapfile/map_file.h"

namespace waymark {

/// Reads a recording once more, for images that a map does not hold.
class RecordedImages {
 public:
  /// Throws InputError like open_input().
  RecordedImages(std::filesystem::path input, InputOptions reading);

  /// Reads all of it: which frames there are, how sharp they are, and, if the map has no images,
  /// those of its keyframes. InputError for images that are not of the size of the map's cameras.
  void survey(const Map& map, bool has_images);

  /// Fills in the frames at the times of some places; places without one are taken away.
  void find(std::vector<FramePlace>& places) const;
  /// Of keyframes; after survey() without images of the map's.
  const KeyframeImages& keyframe_images() const { return keyframe_images_; }

  /// Reads it again and gives each frame's images, JPEG files of camera 0 and, if there is one,
  /// camera 1.
  using Visitor = std::function<void(std::int64_t timestamp_ns, const std::vector<std::string>&)>;
  void for_each(const Visitor& visit) const;

 private:
  std::unique_ptr<Input> open(bool has_jpeg) const;

  const std::filesystem::path input_;
  const InputOptions reading_;
  std::map<std::int64_t, FramePlace> frames_;  // By time; of no place yet.
  KeyframeImages keyframe_images_;
};

}  // namespace waymark

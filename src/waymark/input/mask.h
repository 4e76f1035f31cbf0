// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "waymark/input/input.h"

namespace waymark {

/// Masks of camera 0: one image for all frames, or a folder with one image per frame, named as the
/// frame's image but for the extension.
class MaskSource {
 public:
  /// Path empty: no masks. Throws InputError when it is missing or unreadable.
  explicit MaskSource(const std::filesystem::path& path);

  /// Throws InputError for a folder of masks of which none belongs to a frame with one of these
  /// names: a wrong name would otherwise go unnoticed.
  void expect_one_of(const std::vector<std::string>& stems) const;

  /// Whether the frame whose image has this name (without extension) has a mask.
  bool has(const std::string& stem) const;

  /// Gives a frame with images its mask, if there is one. One that cannot be read or has not the
  /// size of the image is a fault of the frame and takes its images away.
  void attach(const std::string& stem, InputFrame& frame) const;

  /// Throws InputError unless the frame, the first good one, got along with its mask.
  void check_first(const std::string& stem, const InputFrame& frame) const;

 private:
  std::filesystem::path path_of(const std::string& stem) const;

  std::filesystem::path path_;
  std::optional<Image> fixed_;
  std::map<std::string, std::filesystem::path> by_name_;
};

}  // namespace waymark

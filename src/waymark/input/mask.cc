// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/mask.h"

#include <fmt/format.h>

#include <algorithm>

#include "waymark/base/check.h"
#include "waymark/input/decode.h"
#include "waymark/input/listing.h"

namespace waymark {

MaskSource::MaskSource(const std::filesystem::path& path) : path_(path) {
  if (path_.empty()) return;
  if (std::filesystem::is_directory(path_)) {
    for (const std::filesystem::path& image : list_images(path_)) {
      by_name_[image.stem().string()] = image;
    }
    return;
  }
  fixed_ = read_grey_image(path_);
  if (!fixed_) throw InputError(path_.string(), "missing or unreadable, expected a mask image");
}

std::filesystem::path MaskSource::path_of(const std::string& stem) const {
  return fixed_ ? path_ : by_name_.at(stem);
}

void MaskSource::expect_one_of(const std::vector<std::string>& stems) const {
  if (by_name_.empty()) return;
  if (std::any_of(stems.begin(), stems.end(), [this](const auto& stem) { return has(stem); }))
    return;
  throw InputError(path_.string(),
                   fmt::format("no mask has the name of a frame, expected {}.png or the like",
                               stems.empty() ? "NAME" : stems.front()));
}

bool MaskSource::has(const std::string& stem) const { return fixed_ || by_name_.contains(stem); }

void MaskSource::attach(const std::string& stem, InputFrame& frame) const {
  if (!has(stem) || frame.images.empty()) return;
  frame.mask = fixed_ ? fixed_ : read_grey_image(path_of(stem));
  const Image& image = frame.images.front();
  if (!frame.mask) {
    frame.fault = FrameFault::kUnreadable;
  } else if (frame.mask->width_px != image.width_px || frame.mask->height_px != image.height_px) {
    frame.fault = FrameFault::kWrongSize;
  }
  if (frame.fault == FrameFault::kNone) return;
  frame.images.clear();
  frame.depth.reset();
  frame.mask.reset();
}

void MaskSource::check_first(const std::string& stem, const InputFrame& frame) const {
  if (!has(stem) || frame.fault == FrameFault::kNone) return;
  throw InputError(path_of(stem).string(),
                   frame.fault == FrameFault::kWrongSize
                       ? "not the size of the image, expected a mask of the same size"
                       : "unreadable, expected a mask image");
}

}  // namespace waymark

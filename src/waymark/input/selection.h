// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <optional>

#include "waymark/base/check.h"
#include "waymark/input/input.h"

namespace waymark {

/// Which frames of an input are used: first, first + every, ...
struct FrameSelection {
  std::size_t first = 0;
  std::size_t every = 1;
  std::optional<std::size_t> limit;

  /// Frames selected of so many.
  std::size_t count(std::size_t num_frames) const {
    if (num_frames <= first) return 0;
    const std::size_t available = (num_frames - first - 1) / every + 1;
    return limit ? std::min(*limit, available) : available;
  }
};

/// The selection of the options; InputError when it selects nothing.
inline FrameSelection select_frames(const std::filesystem::path& path,
                                    const InputOptions& options,
                                    std::optional<std::size_t> num_frames) {
  const FrameSelection selection{options.first, options.every, options.frames};
  if (options.every == 0) throw InputError("--every", "is 0, expected 1 or more");
  if (options.frames == std::size_t{0}) throw InputError("--frames", "is 0, expected 1 or more");
  if (num_frames && selection.count(*num_frames) == 0) {
    throw InputError("--first",
                     std::to_string(options.first) + " is beyond the " +
                         std::to_string(*num_frames) + " frames of " + path.string() +
                         ", expected less");
  }
  return selection;
}

}  // namespace waymark

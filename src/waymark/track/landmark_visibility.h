// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <vector>

#include "waymark/map/messages.h"

namespace waymark {

/// Counts in how many frames landmarks should have been seen and were.
class VisibilityCounter {
 public:
  void count_visible(LandmarkId landmark) { counts_.push_back({landmark, 1, 0}); }
  void count_found(LandmarkId landmark) { counts_.push_back({landmark, 0, 1}); }
  /// Keeps what is counted short: at rest no keyframe takes it.
  void end_frame() {
    constexpr std::size_t kMany = 100'000;
    if (counts_.size() > kMany) counts_ = take();
  }
  void clear() { counts_.clear(); }

  /// The counts since the last take(), ascending by landmark.
  std::vector<LandmarkVisibility> take() {
    std::ranges::sort(counts_, {}, &LandmarkVisibility::landmark);
    std::vector<LandmarkVisibility> merged;
    for (const LandmarkVisibility& count : counts_) {
      if (merged.empty() || merged.back().landmark != count.landmark) {
        merged.push_back({count.landmark, 0, 0});
      }
      merged.back().num_visible += count.num_visible;
      merged.back().num_found += count.num_found;
    }
    counts_.clear();
    return merged;
  }

 private:
  std::vector<LandmarkVisibility> counts_;
};

}  // namespace waymark

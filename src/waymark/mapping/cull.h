// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <vector>

#include "waymark/mapping/associate.h"
#include "waymark/mapping/options.h"

namespace waymark {

/// Landmarks that were made recently and not yet confirmed by later frames.
class RecentLandmarks {
 public:
  void add(LandmarkId landmark, std::size_t keyframe_count) {
    entries_.push_back({landmark, keyframe_count});
  }

  /// Erases those that were rarely found where they should be seen, or that too few keyframes saw
  /// in time; releases those that stood the test. keyframe_count: keyframes added so far.
  void review(Map& map,
              std::size_t keyframe_count,
              DirtyLandmarks& dirty,
              const CullingOptions& options = {});

 private:
  struct Entry {
    LandmarkId landmark;
    std::size_t added_at = 0;
  };

  std::deque<Entry> entries_;
};

/// Erases keyframes around one whose landmarks others see just as well. Returns them.
std::vector<KeyframeId> cull_redundant_keyframes(Map& map,
                                                 KeyframeId centre,
                                                 DirtyLandmarks& dirty,
                                                 const CullingOptions& options = {});

}  // namespace waymark

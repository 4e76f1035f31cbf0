// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "waymark/base/cow_table.h"
#include "waymark/map/keyframe.h"
#include "waymark/map/landmark.h"

namespace waymark {

/// Counts from scratch, keyframe by keyframe, with how many landmarks others share it. Keeps its
/// counters. What is associated but not there is passed over.
class CovisibilityCounter {
 public:
  CovisibilityCounter(const CowTable<KeyframeId, Keyframe>& keyframes,
                      const CowTable<LandmarkId, Landmark>& landmarks)
      : keyframes_(keyframes), landmarks_(landmarks), num_shared_(keyframes.end_id().value, 0) {}

  Covisibility count(KeyframeId id, const Keyframe& keyframe);

 private:
  const CowTable<KeyframeId, Keyframe>& keyframes_;
  const CowTable<LandmarkId, Landmark>& landmarks_;
  std::vector<std::uint32_t> num_shared_;  // By keyframe; zero between calls.
  std::vector<LandmarkId> seen_;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/match/landmark_set.h"

namespace waymark {

/// The part of the map around the camera.
struct LocalMap {
  KeyframeId reference;               ///< Shares most landmarks with the frame.
  std::vector<KeyframeId> keyframes;  ///< Most shared first.
  LandmarkSet landmarks;              ///< Seen by those keyframes, ascending by id.
};

/// Gathers the keyframes that see the given landmarks (ids of living landmarks; repeats allowed),
/// their strongest neighbours, and what all of these see. Bounded in size, whatever the size of
/// the map. If no keyframe sees any of them, the local map around fallback.
void gather_local_map(const Map& map,
                      std::span<const LandmarkId> seen,
                      KeyframeId fallback,
                      LocalMap& local);

}  // namespace waymark

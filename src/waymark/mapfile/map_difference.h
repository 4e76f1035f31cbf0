// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "waymark/map/map.h"

namespace waymark {

/// What of a map's tables is otherwise than in an earlier state of it. All ids ascend.
struct MapDifference {
  std::vector<KeyframeId> measured;          ///< Keyframes that are new, or whose features are.
  std::vector<KeyframeId> changed;           ///< Others whose pose, place or landmarks are.
  std::vector<KeyframeId> erased;            ///< Keyframes that are gone.
  std::vector<KeyframeId> noted;             ///< Whose odometry is new.
  std::vector<LandmarkId> landmarks;         ///< That are new or changed.
  std::vector<LandmarkId> erased_landmarks;  ///< That are gone.
};

/// Compares two frozen maps; what they share costs nothing. Nothing comes back where the map is no
/// later state of the other, as after a calibration that had it begin anew.
std::optional<MapDifference> find_difference(const Map& before, const Map& now);

}  // namespace waymark

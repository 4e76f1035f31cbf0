// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "waymark/map/map.h"

namespace waymark {

/// Where elements of a map belong, found out on an earlier state of it (a pose graph, a global
/// bundle adjustment).
struct MapCorrection {
  struct KeyframeMove {
    KeyframeId keyframe;
    Rigid3 rig_from_world;
    double scale = 1.0;  ///< New lengths around the keyframe by old ones.
  };
  struct LandmarkMove {
    LandmarkId landmark;
    Eigen::Vector3d position_in_world;
  };
  std::vector<KeyframeMove> keyframes;  ///< Ascending.
  std::vector<LandmarkMove> landmarks;  ///< Ascending.
  /// Found out on the map of now about a part of it: what is not named stays, but for landmarks,
  /// which go with their reference. Takes a time that follows what is named.
  bool is_of_part = false;

  /// The move of a keyframe, or null.
  const KeyframeMove* find(KeyframeId keyframe) const {
    const auto at = std::ranges::lower_bound(keyframes, keyframe, {}, &KeyframeMove::keyframe);
    return at != keyframes.end() && at->keyframe == keyframe ? &*at : nullptr;
  }
  KeyframeMove* find(KeyframeId keyframe) {
    return const_cast<KeyframeMove*>(std::as_const(*this).find(keyframe));
  }
  /// The move of a landmark, or null.
  const LandmarkMove* find(LandmarkId landmark) const {
    const auto at = std::ranges::lower_bound(landmarks, landmark, {}, &LandmarkMove::landmark);
    return at != landmarks.end() && at->landmark == landmark ? &*at : nullptr;
  }
  LandmarkMove* find(LandmarkId landmark) {
    return const_cast<LandmarkMove*>(std::as_const(*this).find(landmark));
  }
};

/// new_world_from_old_world around a keyframe, which stood and was scaled like this before.
Sim3 motion_since(const Rigid3& old_rig_from_world, double old_scale, const Keyframe& now);

/// Moves what the correction names to where it says; what it names but is erased is skipped. What
/// it does not name, being younger, moves along (unless it is of a part): a keyframe by the
/// similarity (rotation, translation, scale) of its nearest ancestor in the spanning tree that is
/// named, and stays if there is none; a landmark, with its size, by that of its reference keyframe.
/// Poses stored relative to a keyframe follow through its applied_scale.
void apply_correction(Map& map, const MapCorrection& correction);

}  // namespace waymark

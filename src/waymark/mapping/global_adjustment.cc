// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/global_adjustment.h"

#include <algorithm>
#include <span>
#include <utility>

#include "waymark/base/median.h"

namespace waymark {
namespace {

/// New by old distance of what a keyframe sees, in the median; 1 where it sees nothing.
double scale_around(const Map& map,
                    const MapCorrection::KeyframeMove& move,
                    std::span<const MapCorrection::LandmarkMove> landmarks) {
  const Keyframe& keyframe = map.keyframes().at(move.keyframe);
  std::vector<double> ratios;
  for (const LandmarkId id : keyframe.landmarks) {
    const auto at = std::lower_bound(
        landmarks.begin(), landmarks.end(), id, [](const auto& landmark, LandmarkId value) {
          return landmark.landmark < value;
        });
    if (!id.is_valid() || at == landmarks.end() || at->landmark != id) continue;
    const Eigen::Vector3d before =
        keyframe.rig_from_world * map.landmarks().at(id).position_in_world;
    const Eigen::Vector3d after = move.rig_from_world * at->position_in_world;
    if (before.norm() > 0.0) ratios.push_back(after.norm() / before.norm());
  }
  const double scale = ratios.empty() ? 1.0 : median(ratios);
  return scale > 0.0 ? scale : 1.0;
}

GlobalAdjustment adjust(const Map& frozen,
                        BundleWindow window,
                        const KnownCalibration* known = nullptr) {
  GlobalAdjustment adjustment;
  if (window.moving.empty() || window.landmarks.empty()) return adjustment;
  WindowAdjustment found =
      compute_adjustment(frozen, window, {.num_rounds = 2, .max_iterations_per_round = 20}, known);
  adjustment.calibration = std::move(found.calibration);
  adjustment.correction = std::move(found.correction);
  adjustment.outliers = std::move(found.outliers);
  adjustment.landmarks = std::move(window.landmarks);
  for (auto& move : adjustment.correction.keyframes) {
    const SubmapId submap = frozen.keyframes().at(move.keyframe).submap;
    if (frozen.submaps()[submap.value].is_metric) continue;
    move.scale = scale_around(frozen, move, adjustment.correction.landmarks);
  }
  return adjustment;
}

}  // namespace

GlobalAdjustment adjust_globally(const Map& frozen, SubmapId submap) {
  return adjust(frozen, whole_submap(frozen, submap));
}

GlobalAdjustment adjust_with_calibration(const Map& frozen, const KnownCalibration& known) {
  return adjust(frozen, whole_map(frozen), &known);
}

void apply_adjustment(Map& map, const GlobalAdjustment& adjustment, DirtyLandmarks& dirty) {
  apply_correction(map, adjustment.correction);
  drop_outliers(map, adjustment.outliers, adjustment.landmarks, dirty);
}

}  // namespace waymark

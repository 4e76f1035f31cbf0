// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/global_adjustment.h"

#include <thread>
#include <utility>

#include "waymark/base/median.h"
#include "waymark/geometry/sim3.h"
#include "waymark/map/correction.h"
#include "waymark/mapping/adjust_parts.h"

namespace waymark {
namespace {

/// The same of a keyframe of both.
Sim3 motion_since(const Map& before, const Map& now, KeyframeId id) {
  const Keyframe& old_one = before.keyframes().at(id);
  return motion_since(old_one.rig_from_world, old_one.applied_scale, now.keyframes().at(id));
}

/// New by old distance of what a keyframe sees, in the median; 1 where it sees nothing.
double scale_around(const Map& map,
                    const MapCorrection::KeyframeMove& move,
                    const MapCorrection& correction) {
  const Keyframe& keyframe = map.keyframes().at(move.keyframe);
  std::vector<double> ratios;
  for (const LandmarkId id : keyframe.landmarks) {
    const auto* const moved = id.is_valid() ? correction.find(id) : nullptr;
    if (!moved) continue;
    const Eigen::Vector3d before =
        keyframe.rig_from_world * map.landmarks().at(id).position_in_world;
    const Eigen::Vector3d after = move.rig_from_world * moved->position_in_world;
    if (before.norm() > 0.0) ratios.push_back(after.norm() / before.norm());
  }
  const double scale = ratios.empty() ? 1.0 : median(ratios);
  return scale > 0.0 ? scale : 1.0;
}

GlobalAdjustment adjust(const Map& frozen,
                        BundleWindow window,
                        const KnownCalibration* known = nullptr,
                        const InertialEvidence* imu = nullptr) {
  GlobalAdjustment adjustment;
  if (window.moving.empty() || window.landmarks.empty()) return adjustment;
  const BundleOptions options{.num_rounds = 2,
                              .max_iterations_per_round = 20,
                              .num_threads = std::thread::hardware_concurrency()};
  WindowAdjustment found =
      window.moving.size() > kMaxAdjustedAtOnce
          ? compute_adjustment_in_parts(frozen, window, options, kMaxAdjustedAtOnce)
          : compute_adjustment(frozen, window, options, known, nullptr, imu);
  if (found.correction.keyframes.empty()) return adjustment;
  adjustment.calibration = std::move(found.calibration);
  adjustment.correction = std::move(found.correction);
  adjustment.outliers = std::move(found.outliers);
  adjustment.landmarks = std::move(window.landmarks);
  for (auto& move : adjustment.correction.keyframes) {
    const SubmapId submap = frozen.keyframes().at(move.keyframe).submap;
    if (frozen.submaps()[submap.value].is_metric) continue;
    move.scale = scale_around(frozen, move, adjustment.correction);
  }
  return adjustment;
}

}  // namespace

GlobalAdjustment adjust_globally(const Map& frozen, SubmapId submap) {
  return adjust(frozen, whole_submap(frozen, submap));
}

GlobalAdjustment adjust_with_imu(const Map& frozen, SubmapId submap, const InertialEvidence& imu) {
  BundleWindow window = whole_submap(frozen, submap);
  if (window.moving.size() > kMaxAdjustedAtOnce) return {};
  return adjust(frozen, std::move(window), nullptr, &imu);
}

GlobalAdjustment adjust_with_calibration(const Map& frozen, const KnownCalibration& known) {
  return adjust(frozen, whole_map(frozen), &known);
}

void rebase(const Map& before, const Map& now, GlobalAdjustment& adjustment) {
  MapCorrection rebased;
  for (MapCorrection::LandmarkMove move : adjustment.correction.landmarks) {
    const Landmark* const landmark = now.landmarks().find(move.landmark);
    if (!landmark || !before.keyframes().contains(landmark->reference)) continue;
    move.position_in_world =
        motion_since(before, now, landmark->reference) * move.position_in_world;
    rebased.landmarks.push_back(move);
  }
  for (MapCorrection::KeyframeMove move : adjustment.correction.keyframes) {
    if (!now.keyframes().contains(move.keyframe)) continue;
    const Sim3 motion = motion_since(before, now, move.keyframe);
    const Sim3 resized({1.0, 0.0, 0.0, 0.0}, Eigen::Vector3d::Zero(), motion.scale);
    const Sim3 moved = resized * Sim3(move.rig_from_world) * motion.inverse();
    move.rig_from_world = {moved.rotation, moved.translation};
    rebased.keyframes.push_back(move);
  }
  adjustment.correction = std::move(rebased);
}

void apply_adjustment(Map& map, const GlobalAdjustment& adjustment, DirtyLandmarks& dirty) {
  apply_correction(map, adjustment.correction);
  drop_outliers(map, adjustment.outliers, adjustment.landmarks, dirty);
}

}  // namespace waymark

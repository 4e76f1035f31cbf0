// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/query_calibration.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "waymark/features/feature_geometry.h"
#include "waymark/mapping/bundle_window.h"

namespace waymark {
namespace {

/// Frames when the calibration is looked at first, then at twice as many up to the last.
constexpr std::size_t kFirstLook = 10;
constexpr std::size_t kLastLook = 40;
/// Fewer landmarks tell nothing.
constexpr std::ptrdiff_t kMinSeenLandmarks = 50;

/// The frames, all that they show of the map, and what else shows that.
BundleWindow window_around(const Map& map, const std::vector<KeyframeId>& frames) {
  BundleWindow window;
  window.moving = frames;
  for (const KeyframeId frame : frames) {
    for (const LandmarkId id : map.keyframes().at(frame).landmarks) {
      if (id.is_valid()) window.landmarks.push_back(id);
    }
  }
  const auto sort = [](auto& ids) {
    std::ranges::sort(ids);
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  };
  sort(window.landmarks);
  for (const LandmarkId id : window.landmarks) {
    for (const Observation& observation : map.landmarks().at(id).observations) {
      if (observation.keyframe < frames.front()) window.fixed.push_back(observation.keyframe);
    }
  }
  sort(window.fixed);
  return window;
}

}  // namespace

QueryCalibration::QueryCalibration(const std::shared_ptr<const Rig>& rig,
                                   const CalibrationSettings& settings,
                                   std::shared_ptr<const Map> map)
    : lasting_(std::move(map)),
      known_(KnownCalibration::as_given(rig, settings.refine == "on")),
      map_(Map::thaw(*lasting_)),
      next_look_(settings.is_refined() && !known_.parameters.empty() ? kFirstLook : 0) {}

bool QueryCalibration::add(const Frame& frame,
                           const Rigid3& rig_from_world,
                           std::span<const LandmarkId> landmarks) {
  if (next_look_ == 0) return false;
  insert(frame, rig_from_world, landmarks);
  if (frames_.size() < next_look_) return false;
  next_look_ = next_look_ < kLastLook ? 2 * next_look_ : 0;
  const bool is_changed = refine();
  if (next_look_ == 0) {  // What was kept has served.
    lasting_.reset();
    map_ = Map();
  }
  return is_changed;
}

void QueryCalibration::insert(const Frame& frame,
                              const Rigid3& rig_from_world,
                              std::span<const LandmarkId> landmarks) {
  const LandmarkId end = lasting_->landmarks().end_id();
  const auto is_lasting = [end](LandmarkId id) { return id.is_valid() && id < end; };
  if (std::ranges::count_if(landmarks, is_lasting) < kMinSeenLandmarks) return;
  const LandmarkId first = *std::ranges::find_if(landmarks, is_lasting);
  Keyframe keyframe;
  keyframe.frame = frame.id;
  keyframe.timestamp_ns = frame.timestamp_ns;
  keyframe.submap = map_.landmarks().at(first).submap;
  keyframe.parent = map_.submaps().at(keyframe.submap.value).root;
  keyframe.applied_scale = map_.keyframes().at(keyframe.parent).applied_scale;
  keyframe.rig_from_world = rig_from_world;
  keyframe.features = frame.features;
  const SubmapId submap = keyframe.submap;
  const KeyframeId id = map_.add_keyframe(std::move(keyframe));
  for (std::uint32_t i = 0; i < frame.features->num_primary; ++i) {
    if (!is_lasting(landmarks[i])) continue;
    if (map_.landmarks().at(landmarks[i]).submap == submap) map_.observe(id, i, landmarks[i]);
  }
  frames_.push_back(id);
}

bool QueryCalibration::refine() {
  const BundleWindow window = window_around(map_, frames_);
  WindowAdjustment found =
      compute_adjustment(map_, window, {.num_rounds = 2, .max_iterations_per_round = 10}, &known_);
  if (!found.calibration) return false;
  known_ = *std::move(found.calibration);
  for (const auto& move : found.correction.keyframes) {
    const Features& features = *map_.keyframes().at(move.keyframe).features;
    map_.recompute_keyframe(move.keyframe, recompute(features, known_.rig, features.motion));
    map_.move_keyframe(move.keyframe, move.rig_from_world);
  }
  return true;
}

}  // namespace waymark

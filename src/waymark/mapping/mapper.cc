// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/mapper.h"

#include <algorithm>
#include <array>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/features/feature_geometry.h"
#include "waymark/mapping/appearance.h"
#include "waymark/mapping/bundle_window.h"
#include "waymark/mapping/fuse.h"
#include "waymark/mapping/triangulate.h"
#include "waymark/mapping/triangulate_edges.h"
#include "waymark/marker/detect.h"

namespace waymark {
namespace {

/// To tell a camera from how it moves takes that many.
constexpr std::size_t kMinCalibrationKeyframes = 6;
/// A rolling shutter, which bends all that the map is made of, shows at so few, or when they turned
/// more.
constexpr std::array<std::size_t, 5> kReadoutKeyframes = {5, 7, 10, 14, 20};

}  // namespace

Mapper::Mapper(std::shared_ptr<const Rig> rig,
               const MappingSettings& settings,
               const CalibrationSettings& calibration)
    : settings_(settings),
      is_calibrating_(calibration.is_refined() && CalibrationParameters(*rig).size() > 0),
      calibration_(KnownCalibration::as_given(std::move(rig), calibration.refine == "on")) {
  calibration_.min_keyframes = kMinCalibrationKeyframes;
}

void Mapper::keep_features_in(std::shared_ptr<std::pmr::memory_resource> memory) {
  feature_memory_ = std::move(memory);
  map_.keep_features_in(feature_memory_);
  std::vector<KeyframeId> ids;
  map_.keyframes().for_each([&](KeyframeId id, const Keyframe&) { ids.push_back(id); });
  for (const KeyframeId id : ids) {
    const Keyframe& keyframe = map_.keyframes().at(id);
    map_.recompute_keyframe(id, keyframe.features);
  }
}

Mapper::Changes Mapper::add(const NewSubmap& message) {
  const SubmapId submap = map_.add_submap(message.is_metric);
  std::vector<KeyframeId> ids;
  for (const InitialKeyframe& initial : message.keyframes) {
    Keyframe keyframe;
    keyframe.frame = initial.frame;
    keyframe.timestamp_ns = initial.timestamp_ns;
    keyframe.submap = submap;
    keyframe.rig_from_world = initial.rig_from_world;
    set_measurements(initial.features, initial.markers, keyframe);
    if (!ids.empty()) keyframe.parent = ids.back();
    ids.push_back(map_.add_keyframe(std::move(keyframe)));
  }
  for (const InitialLandmark& initial : message.landmarks) {
    const LandmarkId id = map_.add_landmark(submap, initial.position_in_world, ids.back());
    for (std::size_t k = ids.size(); k-- > 0;) {  // The reference first.
      if (initial.features[k] != kNoFeature) {
        map_.observe(ids[k], initial.features[k], id);
      }
    }
    dirty_.insert(id);
  }
  refresh_appearances();
  return {std::move(ids), {}};
}

Mapper::Changes Mapper::add(const NewKeyframe& message) {
  const MappingOptions& options = settings_.options;
  const KeyframeId id = insert(message);
  recent_landmarks_.review(map_, id.value, dirty_, options.culling);
  const LandmarkId first_new = map_.landmarks().end_id();
  add_landmarks_from_range(map_, id, dirty_);
  triangulate_with_neighbours(map_, id, epipolar_, dirty_, options.triangulation);
  triangulate_edges(map_, id, dirty_, options.edges);
  for (std::uint32_t value = first_new.value; value < map_.landmarks().end_id().value; ++value) {
    recent_landmarks_.add(LandmarkId{value}, id.value);
  }
  refresh_appearances();
  fuse_with_neighbours(map_, id, projection_, dirty_, options.fusing);
  const BundleWindow window = choose_window(map_,
                                            id,
                                            static_cast<std::size_t>(settings_.window_keyframes),
                                            static_cast<std::size_t>(options.window.max_fixed));
  adjust_window(map_,
                window,
                {.num_rounds = options.window.num_rounds,
                 .max_iterations_per_round = options.window.max_iterations_per_round,
                 .relative_cost_tolerance = options.window.cost_tolerance,
                 .initial_damping = options.window.damping},
                dirty_);
  std::vector<KeyframeId> erased = cull_redundant_keyframes(map_, id, dirty_, options.culling);
  refresh_appearances();
  look_for_readout(id);
  return {{id}, std::move(erased)};
}

void Mapper::look_for_readout(KeyframeId newest) {
  const std::size_t count = map_.keyframes().size();
  if (!is_calibrating_ || std::ranges::find(kReadoutKeyframes, count) == kReadoutKeyframes.end()) {
    return;
  }
  const SubmapId submap = map_.keyframes().at(newest).submap;
  const auto found = waymark::look_for_readout(map_, whole_submap(map_, submap), calibration_);
  if (!found) return;
  set_calibration(*found);
  apply(adjust_globally(map_, submap));
}

KeyframeId Mapper::insert(const NewKeyframe& message) {
  for (const LandmarkVisibility& seen : message.visibility) {
    const LandmarkId landmark = map_.resolve(seen.landmark);
    if (landmark.is_valid()) {
      map_.count_visibility(landmark, seen.num_visible, seen.num_found);
    }
  }
  Keyframe keyframe;
  keyframe.frame = message.frame;
  keyframe.timestamp_ns = message.timestamp_ns;
  keyframe.parent = map_.resolve(message.pose.reference);
  keyframe.submap = map_.keyframes().at(keyframe.parent).submap;
  keyframe.applied_scale = map_.keyframes().at(keyframe.parent).applied_scale;
  keyframe.rig_from_world = map_.rig_from_world(
      message.pose.reference, message.pose.rig_from_reference, message.pose.reference_scale);
  set_measurements(message.features, message.markers, keyframe);
  const KeyframeId id = map_.add_keyframe(std::move(keyframe));
  for (std::uint32_t i = 0; i < message.features->num_primary; ++i) {
    const LandmarkId landmark = map_.resolve(message.landmarks[i]);
    if (!landmark.is_valid()) continue;
    const auto& observations = map_.landmarks().at(landmark).observations;
    // Two of the frame's landmarks may have been merged since.
    if (!observations.empty() && observations.back().keyframe == id) continue;
    map_.observe(id, i, landmark);
    dirty_.insert(landmark);
  }
  return id;
}

void Mapper::set_measurements(const std::shared_ptr<const Features>& features,
                              const std::shared_ptr<const MarkerObservations>& markers,
                              Keyframe& keyframe) const {
  keyframe.motion = features->motion;
  const bool is_up_to_date = features->rig == calibration_.rig;
  keyframe.features =
      is_up_to_date ? features : recompute(*features, calibration_.rig, features->motion);
  keyframe.markers = is_up_to_date ? markers : recompute(markers, *calibration_.rig);
}

void Mapper::set_calibration(const KnownCalibration& calibration) {
  std::vector<KeyframeId> seen_so;
  map_.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (keyframe.features->rig == calibration_.rig) seen_so.push_back(id);
  });
  for (const KeyframeId id : seen_so) {
    const Keyframe& keyframe = map_.keyframes().at(id);
    map_.recompute_keyframe(id, recompute(*keyframe.features, calibration.rig, keyframe.motion));
    map_.observe_markers(id, recompute(map_.keyframes().at(id).markers, *calibration.rig));
    for (const LandmarkId landmark : map_.keyframes().at(id).landmarks) {
      if (landmark.is_valid()) dirty_.insert(landmark);
    }
  }
  calibration_ = calibration;
}

void Mapper::set_motion(KeyframeId id, const RigMotion& motion) {
  map_.set_motion(id, motion);
  const Keyframe& keyframe = map_.keyframes().at(id);
  // That of a global shutter matters only once the shutter turns out to be none.
  if (keyframe.rig().cameras[0].readout_s == 0.0) return;
  map_.recompute_keyframe(id, moved(keyframe.features, motion));
}

void Mapper::apply(const GlobalAdjustment& adjustment) {
  if (adjustment.calibration) set_calibration(*adjustment.calibration);
  apply_adjustment(map_, adjustment, dirty_);
  refresh_appearances();
}

void Mapper::refresh_appearances() {
  for (LandmarkId id : dirty_) {
    if (map_.landmarks().contains(id)) map_.set_appearance(id, describe_landmark(map_, id));
  }
  dirty_.clear();
}

void Mapper::refine_globally(bool with_calibration) {
  if (with_calibration) return apply(adjust_with_calibration(map_, calibration_));
  for (const SubmapId submap : submaps_by_size(map_)) apply(adjust_globally(map_, submap));
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/mapper.h"

#include <utility>

#include "waymark/base/check.h"
#include "waymark/mapping/appearance.h"
#include "waymark/mapping/bundle_window.h"
#include "waymark/mapping/fuse.h"
#include "waymark/mapping/global_adjustment.h"
#include "waymark/mapping/triangulate.h"

namespace waymark {

Mapper::Mapper(std::shared_ptr<const Rig> rig, const MappingSettings& settings)
    : rig_(rig), settings_(settings), projection_(rig) {}

Mapper::Changes Mapper::add(const NewSubmap& message) {
  const SubmapId submap = map_.add_submap(message.is_metric);
  std::vector<KeyframeId> ids;
  for (const InitialKeyframe& initial : message.keyframes) {
    Keyframe keyframe;
    keyframe.frame = initial.frame;
    keyframe.timestamp_ns = initial.timestamp_ns;
    keyframe.submap = submap;
    keyframe.rig_from_world = initial.rig_from_world;
    keyframe.rig = rig_;
    keyframe.features = initial.features;
    if (!ids.empty()) keyframe.parent = ids.back();
    ids.push_back(map_.add_keyframe(std::move(keyframe)));
  }
  for (const InitialLandmark& initial : message.landmarks) {
    const LandmarkId id = map_.add_landmark(submap, initial.position_in_world, ids.back());
    for (std::size_t k = 0; k < ids.size(); ++k) {
      if (initial.features[k] != kNoFeature) {
        observe_with_partner(map_, ids[k], initial.features[k], id);
      }
    }
    dirty_.insert(id);
  }
  refresh_appearances();
  return {std::move(ids), {}};
}

Mapper::Changes Mapper::add(const NewKeyframe& message) {
  const KeyframeId id = insert(message);
  probation_.review(map_, id.value, dirty_);
  const LandmarkId first_new = map_.landmarks().end_id();
  add_landmarks_from_range(map_, id, dirty_);
  triangulate_with_neighbours(map_, id, epipolar_, dirty_);
  for (std::uint32_t value = first_new.value; value < map_.landmarks().end_id().value; ++value) {
    probation_.add(LandmarkId{value}, id.value);
  }
  refresh_appearances();
  fuse_with_neighbours(map_, id, projection_, dirty_);
  const BundleWindow window =
      choose_window(map_, id, static_cast<std::size_t>(settings_.window_keyframes));
  adjust_window(map_, window, {.num_rounds = 2, .max_iterations_per_round = 8}, dirty_);
  std::vector<KeyframeId> erased = cull_redundant_keyframes(map_, id, dirty_);
  refresh_appearances();
  return {{id}, std::move(erased)};
}

KeyframeId Mapper::insert(const NewKeyframe& message) {
  for (const Sighting& sighting : message.sightings) {
    const LandmarkId landmark = map_.resolve(sighting.landmark);
    if (landmark.is_valid()) {
      map_.count_sightings(landmark, sighting.num_visible, sighting.num_found);
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
  keyframe.rig = rig_;
  keyframe.features = message.features;
  const KeyframeId id = map_.add_keyframe(std::move(keyframe));
  for (std::uint32_t i = 0; i < message.features->num_primary; ++i) {
    const LandmarkId landmark = map_.resolve(message.landmarks[i]);
    if (!landmark.is_valid()) continue;
    const auto& observations = map_.landmarks().at(landmark).observations;
    // Two of the frame's landmarks may have been merged since.
    if (!observations.empty() && observations.back().keyframe == id) continue;
    observe_with_partner(map_, id, i, landmark);
    dirty_.insert(landmark);
  }
  return id;
}

void Mapper::refresh_appearances() {
  for (LandmarkId id : dirty_) {
    if (map_.landmarks().contains(id)) map_.set_appearance(id, describe_landmark(map_, id));
  }
  dirty_.clear();
}

void Mapper::refine_globally() {
  for (std::uint32_t value = 0; value < map_.submaps().size(); ++value) {
    if (map_.submaps()[value].joined_into.is_valid()) continue;
    apply_adjustment(map_, adjust_globally(map_, SubmapId{value}), dirty_);
  }
  refresh_appearances();
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/temporary_map.h"

#include <utility>

#include "waymark/mapping/appearance.h"
#include "waymark/mapping/triangulate.h"

namespace waymark {

TemporaryMap::TemporaryMap(const MapSnapshot& lasting)
    : lasting_(lasting), visible_(lasting), map_(Map::thaw(*lasting.map)) {}

void TemporaryMap::add(const NewKeyframe& message) {
  const KeyframeId id = insert(message);
  add_landmarks_from_range(map_, id, dirty_);
  triangulate_with_neighbours(map_, id, epipolar_, dirty_);
  for (const LandmarkId landmark : dirty_) {
    map_.set_appearance(landmark, describe_landmark(map_, landmark));
  }
  dirty_.clear();
  visible_.map = map_.freeze();
}

KeyframeId TemporaryMap::insert(const NewKeyframe& message) {
  const Keyframe& reference = map_.keyframes().at(message.pose.reference);
  Keyframe keyframe;
  keyframe.frame = message.frame;
  keyframe.timestamp_ns = message.timestamp_ns;
  keyframe.parent = message.pose.reference;
  keyframe.submap = reference.submap;
  keyframe.applied_scale = reference.applied_scale;
  keyframe.rig_from_world = message.pose.rig_from_reference * reference.rig_from_world;
  keyframe.features = message.features;
  const KeyframeId id = map_.add_keyframe(std::move(keyframe));
  const LandmarkId end = lasting_.map->landmarks().end_id();
  for (std::uint32_t i = 0; i < message.features->num_primary; ++i) {
    const LandmarkId landmark = message.landmarks[i];
    if (!landmark.is_valid()) continue;
    map_.observe(id, i, landmark);
    if (landmark.value >= end.value) dirty_.insert(landmark);
  }
  return id;
}

void TemporaryMap::clear() {
  map_ = Map::thaw(*lasting_.map);
  visible_ = lasting_;
}

}  // namespace waymark

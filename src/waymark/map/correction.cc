// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/map/correction.h"

#include <map>

#include "waymark/geometry/sim3.h"

namespace waymark {
namespace {

/// new_world_from_old_world around each keyframe that moves.
using Motions = std::map<KeyframeId, Sim3>;

Sim3 motion_of(const MapCorrection::KeyframeMove& move, const Rigid3& old_rig_from_world) {
  const Sim3 resized({1.0, 0.0, 0.0, 0.0}, Eigen::Vector3d::Zero(), move.scale);
  return Sim3(move.rig_from_world.inverse()) * resized * Sim3(old_rig_from_world);
}

/// The motion of the nearest ancestor that has one, given to all on the way.
void inherit(const Map& map, KeyframeId id, Motions& motions) {
  std::vector<KeyframeId> way;
  while (id.is_valid() && !motions.contains(id)) {
    way.push_back(id);
    id = map.keyframes().at(id).parent;
  }
  if (!id.is_valid()) return;
  const Sim3 motion = motions.at(id);
  for (const KeyframeId descendant : way) motions.emplace(descendant, motion);
}

Rigid3 moved(const Rigid3& rig_from_world, const Sim3& motion) {
  const Sim3 resized({1.0, 0.0, 0.0, 0.0}, Eigen::Vector3d::Zero(), motion.scale);
  const Sim3 rig_from_new = resized * Sim3(rig_from_world) * motion.inverse();
  return {rig_from_new.rotation, rig_from_new.translation};
}

void move_keyframes(Map& map, const MapCorrection& correction, const Motions& motions) {
  auto named = correction.keyframes.begin();
  for (const auto& [id, motion] : motions) {
    while (named != correction.keyframes.end() && named->keyframe < id) ++named;
    const bool is_named = named != correction.keyframes.end() && named->keyframe == id;
    // What is named goes exactly where it is told to.
    map.move_keyframe(
        id,
        is_named ? named->rig_from_world : moved(map.keyframes().at(id).rig_from_world, motion));
    map.rescale_keyframe(id, motion.scale);
  }
}

void move_landmarks(Map& map, const MapCorrection& correction, const Motions& motions) {
  struct Move {
    LandmarkId landmark;
    Eigen::Vector3d position_in_world;
    Appearance appearance;
  };
  std::vector<Move> moves;
  auto named = correction.landmarks.begin();
  map.landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
    while (named != correction.landmarks.end() && named->landmark < id) ++named;
    const bool is_named = named != correction.landmarks.end() && named->landmark == id;
    const auto motion = motions.find(landmark.reference);
    if (!is_named && motion == motions.end()) return;
    Move move{id, landmark.position_in_world, landmark.appearance};
    if (motion != motions.end()) {
      move.position_in_world = motion->second * move.position_in_world;
      move.appearance.direction = motion->second.rotation * move.appearance.direction;
      move.appearance.size_m *= motion->second.scale;
    }
    if (is_named) move.position_in_world = named->position_in_world;
    moves.push_back(move);
  });
  for (const Move& move : moves) {
    map.move_landmark(move.landmark, move.position_in_world);
    map.set_appearance(move.landmark, move.appearance);
  }
}

}  // namespace

void apply_correction(Map& map, const MapCorrection& correction) {
  Motions motions;
  for (const MapCorrection::KeyframeMove& move : correction.keyframes) {
    const Keyframe* keyframe = map.keyframes().find(move.keyframe);
    if (keyframe) motions.emplace(move.keyframe, motion_of(move, keyframe->rig_from_world));
  }
  map.keyframes().for_each([&](KeyframeId id, const Keyframe&) { inherit(map, id, motions); });
  move_landmarks(map, correction, motions);
  move_keyframes(map, correction, motions);
}

}  // namespace waymark

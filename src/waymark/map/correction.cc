// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/map/correction.h"

#include <optional>
#include <vector>

#include "waymark/geometry/sim3.h"

namespace waymark {
namespace {

/// new_world_from_old_world around each keyframe that moves, by value of the id.
using Motions = std::vector<std::optional<Sim3>>;

Sim3 motion_of(const MapCorrection::KeyframeMove& move, const Rigid3& old_rig_from_world) {
  const Sim3 resized({1.0, 0.0, 0.0, 0.0}, Eigen::Vector3d::Zero(), move.scale);
  return Sim3(move.rig_from_world.inverse()) * resized * Sim3(old_rig_from_world);
}

/// The motion of the nearest ancestor that has one, given to all on the way.
void inherit(const Map& map, KeyframeId id, Motions& motions) {
  std::vector<KeyframeId> way;
  while (id.is_valid() && !motions[id.value]) {
    way.push_back(id);
    id = map.keyframes().at(id).parent;
  }
  if (!id.is_valid()) return;
  for (const KeyframeId descendant : way) motions[descendant.value] = motions[id.value];
}

Rigid3 moved(const Rigid3& rig_from_world, const Sim3& motion) {
  const Sim3 resized({1.0, 0.0, 0.0, 0.0}, Eigen::Vector3d::Zero(), motion.scale);
  const Sim3 rig_from_new = resized * Sim3(rig_from_world) * motion.inverse();
  return {rig_from_new.rotation, rig_from_new.translation};
}

void move_keyframes(Map& map, const MapCorrection& correction, const Motions& motions) {
  auto named = correction.keyframes.begin();
  for (KeyframeId id{0}; id.value < motions.size(); ++id.value) {
    if (!motions[id.value]) continue;
    while (named != correction.keyframes.end() && named->keyframe < id) ++named;
    const bool is_named = named != correction.keyframes.end() && named->keyframe == id;
    // What is named goes exactly where it is told to.
    map.move_keyframe(id,
                      is_named ? named->rig_from_world
                               : moved(map.keyframes().at(id).rig_from_world, *motions[id.value]));
    map.rescale_keyframe(id, motions[id.value]->scale);
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
    const bool has_reference = landmark.reference.value < motions.size();
    const std::optional<Sim3> motion =
        has_reference ? motions[landmark.reference.value] : std::nullopt;
    if (!is_named && !motion) return;
    Move move{id, landmark.position_in_world, landmark.appearance};
    if (motion) {
      move.position_in_world = *motion * move.position_in_world;
      move.appearance.direction = motion->rotation * move.appearance.direction;
      move.appearance.size_m *= motion->scale;
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
  Motions motions(map.keyframes().end_id().value);
  for (const MapCorrection::KeyframeMove& move : correction.keyframes) {
    const Keyframe* keyframe = map.keyframes().find(move.keyframe);
    if (keyframe) motions[move.keyframe.value] = motion_of(move, keyframe->rig_from_world);
  }
  map.keyframes().for_each([&](KeyframeId id, const Keyframe&) { inherit(map, id, motions); });
  move_landmarks(map, correction, motions);
  move_keyframes(map, correction, motions);
}

}  // namespace waymark

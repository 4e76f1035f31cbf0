// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/map/correction.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "waymark/geometry/sim3.h"

namespace waymark {
namespace {

/// new_world_from_old_world around each keyframe that moves.
class MotionTable {
 public:
  explicit MotionTable(KeyframeId end) : place_of_id_(end.value, kNone) {}

  void set(KeyframeId id, const Sim3& motion) {
    place_of_id_[id.value] = static_cast<std::uint32_t>(motions_.size());
    motions_.push_back(motion);
  }
  void share(KeyframeId id, KeyframeId with) { place_of_id_[id.value] = place_of_id_[with.value]; }
  /// Null where there is none.
  const Sim3* find(KeyframeId id) const {
    const bool is_known = id.value < place_of_id_.size() && place_of_id_[id.value] != kNone;
    return is_known ? &motions_[place_of_id_[id.value]] : nullptr;
  }
  KeyframeId end() const { return KeyframeId{static_cast<std::uint32_t>(place_of_id_.size())}; }

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;

  std::vector<std::uint32_t> place_of_id_;  // By value of the id.
  std::vector<Sim3> motions_;
};

Sim3 motion_of(const MapCorrection::KeyframeMove& move, const Rigid3& old_rig_from_world) {
  const Sim3 resized({1.0, 0.0, 0.0, 0.0}, Eigen::Vector3d::Zero(), move.scale);
  return Sim3(move.rig_from_world.inverse()) * resized * Sim3(old_rig_from_world);
}

/// The motion of the nearest ancestor that has one, given to all on the way.
void inherit(const Map& map, KeyframeId id, MotionTable& motions) {
  std::vector<KeyframeId> way;
  while (id.is_valid() && !motions.find(id)) {
    way.push_back(id);
    id = map.keyframes().at(id).parent;
  }
  if (!id.is_valid()) return;
  for (const KeyframeId descendant : way) motions.share(descendant, id);
}

Rigid3 moved(const Rigid3& rig_from_world, const Sim3& motion) {
  const Sim3 resized({1.0, 0.0, 0.0, 0.0}, Eigen::Vector3d::Zero(), motion.scale);
  const Sim3 rig_from_new = resized * Sim3(rig_from_world) * motion.inverse();
  return {rig_from_new.rotation, rig_from_new.translation};
}

void move_keyframes(Map& map, const MapCorrection& correction, const MotionTable& motions) {
  auto named = correction.keyframes.begin();
  for (KeyframeId id{0}; id < motions.end(); ++id.value) {
    const Sim3* const motion = motions.find(id);
    if (!motion) continue;
    while (named != correction.keyframes.end() && named->keyframe < id) ++named;
    const bool is_named = named != correction.keyframes.end() && named->keyframe == id;
    // What is named goes exactly where it is told to.
    map.move_keyframe(
        id,
        is_named ? named->rig_from_world : moved(map.keyframes().at(id).rig_from_world, *motion));
    map.rescale_keyframe(id, motion->scale);
  }
}

/// Those that may move, ascending.
template <class Visit>
void for_each_landmark(const Map& map, const MapCorrection& correction, const Visit& visit) {
  if (!correction.is_of_part) {
    map.landmarks().for_each(visit);
    return;
  }
  std::vector<LandmarkId> ids;
  for (const MapCorrection::LandmarkMove& move : correction.landmarks) ids.push_back(move.landmark);
  for (const MapCorrection::KeyframeMove& move : correction.keyframes) {
    const Keyframe* const keyframe = map.keyframes().find(move.keyframe);
    if (!keyframe) continue;
    for (const LandmarkId id : keyframe->landmarks) {
      if (id.is_valid() && map.landmarks().at(id).reference == move.keyframe) ids.push_back(id);
    }
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  for (const LandmarkId id : ids) {
    if (const Landmark* const landmark = map.landmarks().find(id)) visit(id, *landmark);
  }
}

void move_landmarks(Map& map, const MapCorrection& correction, const MotionTable& motions) {
  struct Move {
    LandmarkId landmark;
    Eigen::Vector3d position_in_world;
    Appearance appearance;
  };
  std::vector<Move> moves;
  auto named = correction.landmarks.begin();
  for_each_landmark(map, correction, [&](LandmarkId id, const Landmark& landmark) {
    while (named != correction.landmarks.end() && named->landmark < id) ++named;
    const bool is_named = named != correction.landmarks.end() && named->landmark == id;
    const Sim3* const motion = motions.find(landmark.reference);
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

Sim3 motion_since(const Rigid3& old_rig_from_world, double old_scale, const Keyframe& now) {
  const Sim3 resized({1.0, 0.0, 0.0, 0.0}, Eigen::Vector3d::Zero(), now.applied_scale / old_scale);
  return Sim3(now.rig_from_world.inverse()) * resized * Sim3(old_rig_from_world);
}

void apply_correction(Map& map, const MapCorrection& correction) {
  MotionTable motions(map.keyframes().end_id());
  for (const MapCorrection::KeyframeMove& move : correction.keyframes) {
    const Keyframe* keyframe = map.keyframes().find(move.keyframe);
    if (keyframe) motions.set(move.keyframe, motion_of(move, keyframe->rig_from_world));
  }
  if (!correction.is_of_part) {
    map.keyframes().for_each([&](KeyframeId id, const Keyframe&) { inherit(map, id, motions); });
  }
  move_landmarks(map, correction, motions);
  move_keyframes(map, correction, motions);
}

}  // namespace waymark

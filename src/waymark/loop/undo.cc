// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/undo.h"

#include <optional>
#include <utility>
#include <vector>

#include "waymark/loop/odometry.h"
#include "waymark/map/correction.h"

namespace waymark {
namespace {

/// Squared residual, in pixels of the level, from which on a feature does not see a landmark. What
/// hangs together stays so: until all is adjusted again, it may be a few pixels off.
constexpr double kMaxSquaredOfTogether = 100.0;

/// Where keyframes have what lies around them, before and after a correction.
class Motions {
 public:
  explicit Motions(const Map& before) : old_(before.keyframes().end_id().value) {
    before.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
      old_[id.value] = {keyframe.rig_from_world, keyframe.applied_scale};
    });
  }

  /// new_world_from_old_world around a keyframe.
  Sim3 of(const Map& now, KeyframeId id) const {
    const auto& [old_rig_from_world, old_scale] = *old_[id.value];
    return motion_since(old_rig_from_world, old_scale, now.keyframes().at(id));
  }

 private:
  std::vector<std::optional<std::pair<Rigid3, double>>> old_;
};

bool still_sees(const Map& map, const Observation& observation, const Eigen::Vector3d& point) {
  const Keyframe& keyframe = map.keyframes().at(observation.keyframe);
  const auto squared = squared_residual(keyframe, observation.feature, point);
  return squared && *squared < kMaxSquaredOfTogether;
}

/// Splits one landmark until each part is seen by all its observations.
void split(Map& map, LandmarkId id, const Motions& motions, DirtyLandmarks& dirty) {
  const Landmark whole = map.landmarks().at(id);
  const Sim3 old_from_new = motions.of(map, whole.reference).inverse();
  std::vector<Observation> rest;
  for (const Observation& observation : whole.observations) {
    if (!still_sees(map, observation, whole.position_in_world)) rest.push_back(observation);
  }
  if (rest.empty()) return;
  for (const Observation& observation : rest) map.forget(observation.keyframe, observation.feature);
  dirty.insert(id);
  if (rest.size() == whole.observations.size()) {
    map.erase_landmark(id);
    dirty.erase(id);
  }
  while (rest.size() >= 2) {
    const Eigen::Vector3d position =
        motions.of(map, rest.front().keyframe) * (old_from_new * whole.position_in_world);
    std::vector<Observation> part, others;
    for (const Observation& observation : rest) {
      (still_sees(map, observation, position) ? part : others).push_back(observation);
    }
    if (part.size() >= 2) {
      const LandmarkId own = map.add_landmark(whole.submap, position, part.front().keyframe);
      for (const Observation& seen : part) map.observe(seen.keyframe, seen.feature, own);
      map.set_appearance(own, whole.appearance);
      map.count_visibility(own, whole.num_visible, whole.num_found);
      dirty.insert(own);
    } else {
      others.assign(rest.begin() + 1, rest.end());
    }
    rest = std::move(others);
  }
}

}  // namespace

void undo_loops(Map& map,
                SubmapId submap,
                std::span<const std::uint8_t> is_on,
                std::span<const LoopEdge> also,
                DirtyLandmarks& dirty) {
  std::vector<LoopEdge> kept;
  for (std::size_t i = 0; i < is_on.size(); ++i) {
    if (is_on[i]) kept.push_back(map.measured_loop_edges()[i]);
  }
  kept.insert(kept.end(), also.begin(), also.end());
  map.drop_loop_edges(is_on);
  const Motions motions(map);
  apply_correction(map, place_by_odometry(map, submap, kept));
  std::vector<LandmarkId> landmarks;
  map.landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
    if (landmark.submap == submap) landmarks.push_back(id);
  });
  for (const LandmarkId id : landmarks) split(map, id, motions, dirty);
}

}  // namespace waymark

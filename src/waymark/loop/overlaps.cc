// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/overlaps.h"

#include <algorithm>
#include <vector>

#include "waymark/loop/drift.h"
#include "waymark/loop/near_in_graph.h"
#include "waymark/mapping/fuse.h"

namespace waymark {
namespace {

/// Views further apart, in parts of the depth of the scene and in radians, show too little of the
/// same.
constexpr double kMaxDistance = 0.6;
constexpr double kMaxAngleRad = 0.5;
constexpr std::size_t kMaxSources = 6;

/// The nearest keyframes of the same sub-map that share next to nothing with this one.
std::vector<KeyframeId> strangers_beside(const Map& map, KeyframeId target) {
  struct Stranger {
    double distance;
    KeyframeId keyframe;
  };
  const Keyframe& in_target = map.keyframes().at(target);
  const double depth = median_depth(map, target);
  const std::vector<KeyframeId> known = within_steps(map, target, 1);
  std::vector<Stranger> strangers;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (keyframe.submap != in_target.submap) return;
    if (std::binary_search(known.begin(), known.end(), id)) return;
    const Rigid3 target_from_id = in_target.rig_from_world * keyframe.rig_from_world.inverse();
    const double distance = target_from_id.translation.norm() / depth;
    const double angle = Eigen::AngleAxisd(target_from_id.rotation).angle();
    if (distance < kMaxDistance && angle < kMaxAngleRad)
      strangers.push_back({distance + angle, id});
  });
  std::stable_sort(strangers.begin(), strangers.end(), [](const Stranger& a, const Stranger& b) {
    return a.distance < b.distance;
  });
  if (strangers.size() > kMaxSources) strangers.resize(kMaxSources);
  std::vector<KeyframeId> ids;
  for (const Stranger& stranger : strangers) ids.push_back(stranger.keyframe);
  return ids;
}

}  // namespace

void fuse_overlaps(Map& map, ProjectionMatcher& matcher, DirtyLandmarks& dirty) {
  const std::uint32_t end = map.keyframes().end_id().value;
  for (KeyframeId id{0}; id.value < end; ++id.value) {
    if (!map.keyframes().contains(id)) continue;
    const std::vector<KeyframeId> sources = strangers_beside(map, id);
    if (!sources.empty()) fuse_into(map, sources, id, matcher, dirty);
  }
}

}  // namespace waymark

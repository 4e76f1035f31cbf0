// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/beside.h"

#include <algorithm>

#include "waymark/loop/drift.h"
#include "waymark/loop/near_in_graph.h"

namespace waymark {

std::vector<KeyframeId> strangers_beside(const Map& map,
                                         KeyframeId keyframe,
                                         int num_known_steps,
                                         const ViewReach& reach) {
  struct Stranger {
    double distance;
    KeyframeId keyframe;
  };
  const Keyframe& here = map.keyframes().at(keyframe);
  const double depth = median_depth(map, keyframe);
  const std::vector<KeyframeId> known = within_steps(map, keyframe, num_known_steps);
  std::vector<Stranger> strangers;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& other) {
    if (other.submap != here.submap) return;
    if (std::binary_search(known.begin(), known.end(), id)) return;
    const Rigid3 here_from_other = here.rig_from_world * other.rig_from_world.inverse();
    const double distance = here_from_other.translation.norm() / depth;
    const double angle = Eigen::AngleAxisd(here_from_other.rotation).angle();
    if (distance >= reach.distance || angle >= reach.angle_rad) return;
    strangers.push_back({distance + angle, id});
  });
  std::stable_sort(strangers.begin(), strangers.end(), [](const Stranger& a, const Stranger& b) {
    return a.distance < b.distance;
  });
  std::vector<KeyframeId> ids;
  for (const Stranger& stranger : strangers) ids.push_back(stranger.keyframe);
  return ids;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/near_in_graph.h"

#include <algorithm>
#include <iterator>

namespace waymark {

std::vector<KeyframeId> within_steps(const Map& map, KeyframeId keyframe, int num_steps) {
  std::vector<KeyframeId> near = {keyframe};
  std::vector<KeyframeId> front = near;
  for (int step = 0; step < num_steps; ++step) {
    std::vector<KeyframeId> next;
    for (KeyframeId id : front) {
      const KeyframeId parent = map.keyframes().at(id).parent;
      if (parent.is_valid()) next.push_back(parent);
      for (const CovisibilityEdge& edge : map.covisible(id)) {
        if (edge.num_shared >= kMinSharedOfLinked) next.push_back(edge.keyframe);
      }
    }
    std::sort(next.begin(), next.end());
    next.erase(std::unique(next.begin(), next.end()), next.end());
    front.clear();
    std::set_difference(
        next.begin(), next.end(), near.begin(), near.end(), std::back_inserter(front));
    near.insert(near.end(), front.begin(), front.end());
    std::sort(near.begin(), near.end());
  }
  return near;
}

}  // namespace waymark

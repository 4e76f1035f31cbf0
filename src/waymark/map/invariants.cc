// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>

#include "waymark/map/map.h"

namespace waymark {
namespace {

using SharedCounts = std::map<std::pair<KeyframeId, KeyframeId>, std::uint32_t>;

std::string name(KeyframeId id) { return "keyframe " + std::to_string(id.value); }
std::string name(LandmarkId id) { return "landmark " + std::to_string(id.value); }

std::string broken_keyframe(const Map& map, KeyframeId id, const Keyframe& keyframe) {
  if (keyframe.landmarks.size() != keyframe.features->size()) return "wrong number of landmarks";
  if (map.submaps().at(keyframe.submap.value).joined_into.is_valid()) return "in a joined sub-map";
  const bool is_root = map.submaps()[keyframe.submap.value].root == id;
  if (is_root == keyframe.parent.is_valid()) return "is a root with a parent or neither";
  if (!is_root && !map.keyframes().find(keyframe.parent)) return "its parent is gone";
  if (!is_root && map.keyframes().at(keyframe.parent).submap != keyframe.submap) {
    return "its parent is in another sub-map";
  }
  KeyframeId ancestor = keyframe.parent;
  for (std::size_t steps = 0; ancestor.is_valid(); ++steps) {
    if (steps > map.keyframes().size()) return "the spanning tree has a cycle";
    ancestor = map.keyframes().at(ancestor).parent;
  }
  for (std::uint32_t feature = 0; feature < keyframe.landmarks.size(); ++feature) {
    const LandmarkId landmark_id = keyframe.landmarks[feature];
    if (!landmark_id.is_valid()) continue;
    const Landmark* landmark = map.landmarks().find(landmark_id);
    if (!landmark) return "sees erased " + name(landmark_id);
    if (!std::binary_search(landmark->observations.begin(),
                            landmark->observations.end(),
                            Observation{id, feature})) {
      return "is not among the observers of " + name(landmark_id);
    }
  }
  return "";
}

std::string broken_landmark(const Map& map, LandmarkId id, const Landmark& landmark) {
  if (!landmark.position_in_world.allFinite()) return "its position is not finite";
  const auto& observations = landmark.observations;
  if (!std::is_sorted(observations.begin(), observations.end())) return "observations not in order";
  if (std::adjacent_find(observations.begin(), observations.end()) != observations.end()) {
    return "an observation twice";
  }
  bool has_reference = observations.empty();
  for (const Observation& observation : observations) {
    const Keyframe* keyframe = map.keyframes().find(observation.keyframe);
    if (!keyframe) return "seen by erased " + name(observation.keyframe);
    if (keyframe->landmarks.at(observation.feature) != id) return "one-sided observation";
    if (keyframe->submap != landmark.submap) return "seen from another sub-map";
    has_reference |= observation.keyframe == landmark.reference;
  }
  return has_reference ? "" : "its reference does not see it";
}

SharedCounts count_shared(const Map& map) {
  SharedCounts counts;
  map.landmarks().for_each([&](LandmarkId, const Landmark& landmark) {
    std::vector<KeyframeId> observers;
    for (const Observation& o : landmark.observations) observers.push_back(o.keyframe);
    observers.erase(std::unique(observers.begin(), observers.end()), observers.end());
    for (KeyframeId a : observers) {
      for (KeyframeId b : observers) {
        if (a != b) ++counts[{a, b}];
      }
    }
  });
  return counts;
}

}  // namespace

std::string Map::broken_invariants() const {
  std::string broken;
  const auto report = [&](const std::string& where, const std::string& what) {
    if (broken.empty() && !what.empty()) broken = where + ": " + what;
  };
  keyframes_.for_each([&](KeyframeId id, const Keyframe& keyframe) {
    report(name(id), broken_keyframe(*this, id, keyframe));
  });
  landmarks_.for_each([&](LandmarkId id, const Landmark& landmark) {
    report(name(id), broken_landmark(*this, id, landmark));
  });
  for (const LoopEdge& edge : loop_edges_) {
    const Keyframe* from = keyframes_.find(edge.from);
    const Keyframe* to = keyframes_.find(edge.to);
    if (!from || !to) {
      report("loop edge", "one of its keyframes is gone");
    } else if (from->submap != to->submap) {
      report("loop edge", "its keyframes are in different sub-maps");
    }
  }
  SharedCounts stored;
  covisibility_.for_each([&](KeyframeId id, const Covisibility& covisibility) {
    for (const CovisibilityEdge& edge : covisibility.edges) {
      stored[{id, edge.keyframe}] = edge.num_shared;
    }
  });
  if (broken.empty() && stored != count_shared(*this)) return "covisibility counts differ";
  return broken;
}

}  // namespace waymark

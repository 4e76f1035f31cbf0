// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "waymark/map/map.h"

namespace waymark {
namespace {

std::string name(SubmapId id) { return "submap " + std::to_string(id.value); }
std::string name(KeyframeId id) { return "keyframe " + std::to_string(id.value); }
std::string name(LandmarkId id) { return "landmark " + std::to_string(id.value); }

/// Lines of what is wrong, up to so many.
class Findings {
 public:
  explicit Findings(std::size_t max_count) : max_count_(max_count) {}

  void add(const std::string& where, const std::string& what) {
    if (!what.empty() && !is_full()) lines_.push_back(where + ": " + what);
  }
  bool is_full() const { return lines_.size() >= max_count_; }
  std::vector<std::string> take() { return std::move(lines_); }

 private:
  std::size_t max_count_;
  std::vector<std::string> lines_;
};

/// The row of a sub-map that is a part of its own, else nothing.
const Submap* find_open(const Map& map, SubmapId id) {
  if (id.value >= map.submaps().size()) return nullptr;
  const Submap& submap = map.submaps()[id.value];
  return submap.joined_into.is_valid() ? nullptr : &submap;
}

std::string broken_submap(const Map& map, SubmapId id, const Submap& submap) {
  if (!submap.joined_into.is_valid()) {
    if (!submap.root.is_valid()) return "";  // New, without keyframes; those would complain.
    const Keyframe* root = map.keyframes().find(submap.root);
    if (!root) return "its root is gone";
    return root->submap == id ? "" : "its root is in another sub-map";
  }
  if (submap.root.is_valid()) return "is joined but has a root";
  SubmapId at = id;
  for (std::size_t steps = 0; at.is_valid(); ++steps) {
    if (at.value >= map.submaps().size()) return "is joined into one that is not there";
    if (steps > map.submaps().size()) return "is joined in a cycle";
    if (map.submaps()[at.value].is_metric != submap.is_metric) {
      return "is joined into one whose scale is free where its own is not, or the reverse";
    }
    at = map.submaps()[at.value].joined_into;
  }
  return "";
}

/// Ids whose way along next(id) never ends; next gives an invalid id at the end.
template <class Id, class Next>
std::vector<Id> find_endless(Id end, const Next& next) {
  enum class State : std::uint8_t { kUnknown, kOnTheWay, kEnds, kEndless };
  std::vector<State> states(end.value, State::kUnknown);
  std::vector<Id> way;
  for (Id start{0}; start.value < end.value; ++start.value) {
    way.clear();
    Id id = start;
    while (id.value < end.value && states[id.value] == State::kUnknown) {
      states[id.value] = State::kOnTheWay;
      way.push_back(id);
      id = next(id);
    }
    const bool ends = id.value >= end.value || states[id.value] == State::kEnds;
    for (const Id passed : way) states[passed.value] = ends ? State::kEnds : State::kEndless;
  }
  std::vector<Id> endless;
  for (Id id{0}; id.value < end.value; ++id.value) {
    if (states[id.value] == State::kEndless) endless.push_back(id);
  }
  return endless;
}

std::string broken_association(const Map& map, KeyframeId id, std::uint32_t feature) {
  const LandmarkId landmark_id = map.keyframes().at(id).landmarks[feature];
  if (!landmark_id.is_valid()) return "";
  const Landmark* landmark = map.landmarks().find(landmark_id);
  if (!landmark) return "sees " + name(landmark_id) + ", which is not there";
  const bool is_mutual = std::binary_search(
      landmark->observations.begin(), landmark->observations.end(), Observation{id, feature});
  return is_mutual ? "" : "is not among the observers of " + name(landmark_id);
}

std::string broken_keyframe(const Map& map, KeyframeId id, const Keyframe& keyframe) {
  if (keyframe.landmarks.size() != keyframe.features->size()) return "wrong number of landmarks";
  if (!keyframe.rig_from_world.translation.allFinite()) return "its position is not finite";
  const Submap* submap = find_open(map, keyframe.submap);
  if (!submap) return "in a sub-map that is joined or not there";
  const bool is_root = submap->root == id;
  if (is_root == keyframe.parent.is_valid()) return "is a root with a parent or neither";
  if (is_root) return "";
  const Keyframe* parent = map.keyframes().find(keyframe.parent);
  if (!parent) return "its parent is gone";
  return parent->submap == keyframe.submap ? "" : "its parent is in another sub-map";
}

std::string broken_landmark(const Map& map, LandmarkId id, const Landmark& landmark) {
  if (!landmark.position_in_world.allFinite()) return "its position is not finite";
  if (!find_open(map, landmark.submap)) return "in a sub-map that is joined or not there";
  if (landmark.reference >= map.keyframes().end_id()) return "its reference was never there";
  const auto& observations = landmark.observations;
  if (!std::is_sorted(observations.begin(), observations.end())) return "observations not in order";
  if (std::adjacent_find(observations.begin(), observations.end()) != observations.end()) {
    return "an observation twice";
  }
  bool has_reference = observations.empty();
  for (const Observation& observation : observations) {
    const Keyframe* keyframe = map.keyframes().find(observation.keyframe);
    if (!keyframe) return "seen by erased " + name(observation.keyframe);
    if (observation.feature >= keyframe->landmarks.size() ||
        keyframe->landmarks[observation.feature] != id) {
      return "one-sided observation";
    }
    if (keyframe->submap != landmark.submap) return "seen from another sub-map";
    has_reference |= observation.keyframe == landmark.reference;
  }
  return has_reference ? "" : "its reference does not see it";
}

void find_broken_keyframes(const Map& map, Findings& findings) {
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    findings.add(name(id), broken_keyframe(map, id, keyframe));
    for (std::uint32_t feature = 0; feature < keyframe.landmarks.size(); ++feature) {
      if (!findings.is_full()) findings.add(name(id), broken_association(map, id, feature));
    }
  });
  const auto parent_of = [&](KeyframeId id) {
    const Keyframe* keyframe = map.keyframes().find(id);
    return keyframe ? keyframe->parent : KeyframeId{};
  };
  for (const KeyframeId id : find_endless(map.keyframes().end_id(), parent_of)) {
    findings.add(name(id), "the spanning tree has a cycle above it");
  }
}

void find_broken_forwarding(const Map& map, Findings& findings) {
  const KeyframeId end = map.keyframes().end_id();
  for (KeyframeId id{0}; id < end; ++id.value) {
    const KeyframeForwarding* forwarding = map.keyframe_forwarding().find(id);
    const bool is_forwarded = forwarding && forwarding->heir.is_valid();
    if (map.keyframes().contains(id) == is_forwarded) {
      findings.add(name(id), is_forwarded ? "lives and has an heir" : "is erased without an heir");
    } else if (is_forwarded && forwarding->heir >= end) {
      findings.add(name(id), "its heir was never there");
    }
  }
  const auto heir_of = [&](KeyframeId id) {
    const KeyframeForwarding* forwarding = map.keyframe_forwarding().find(id);
    return forwarding ? forwarding->heir : KeyframeId{};
  };
  for (const KeyframeId id : find_endless(end, heir_of)) {
    findings.add(name(id), "its heirs go round in a cycle");
  }
  const LandmarkId end_landmark = map.landmarks().end_id();
  std::vector<std::pair<LandmarkId, LandmarkId>> merged;
  map.landmark_forwarding().for_each([&](LandmarkId id, const LandmarkForwarding& forwarding) {
    const LandmarkId survivor = forwarding.survivor;
    merged.push_back({id, survivor});
    if (map.landmarks().contains(id)) findings.add(name(id), "lives and was merged");
    if (survivor >= end_landmark) findings.add(name(id), "was merged into one never there");
  });
  // By place among the merged ones, so that ids which are gone cost nothing.
  struct PlaceTag;
  using Place = Id<PlaceTag>;
  const auto next = [&](Place place) {
    const LandmarkId survivor = merged[place.value].second;
    const auto at =
        std::ranges::lower_bound(merged, survivor, {}, &std::pair<LandmarkId, LandmarkId>::first);
    const bool is_merged = at != merged.end() && at->first == survivor;
    return is_merged ? Place{static_cast<std::uint32_t>(at - merged.begin())} : Place{};
  };
  for (const Place place : find_endless(Place{static_cast<std::uint32_t>(merged.size())}, next)) {
    findings.add(name(merged[place.value].first), "was merged in a cycle");
  }
}

void find_broken_loop_edges(const Map& map, Findings& findings) {
  std::size_t index = 0;
  for (const LoopEdge& edge : map.measured_loop_edges()) {
    const std::string where = "loop_edge " + std::to_string(index++);
    const Keyframe* from = map.keyframes().find(edge.from);
    const Keyframe* to = map.keyframes().find(edge.to);
    if (!from || !to) {
      findings.add(where, "one of its keyframes is gone");
    } else if (edge.from == edge.to) {
      findings.add(where, "ties a keyframe to itself");
    } else if (from->submap != to->submap) {
      findings.add(where, "its keyframes are in different sub-maps");
    }
  }
}

void find_broken_odometry(const Map& map, Findings& findings) {
  const KeyframeId end = map.keyframes().end_id();
  map.odometry().for_each([&](KeyframeId id, const OdometryNode& node) {
    if (id >= end) findings.add(name(id), "its odometry was noted, though it was never there");
    if (node.parent.is_valid() && node.parent >= end) {
      findings.add(name(id), "its odometry is from a keyframe that was never there");
    }
  });
  const auto parent_of = [&](KeyframeId id) {
    const OdometryNode* node = map.odometry().find(id);
    return node ? node->parent : KeyframeId{};
  };
  for (const KeyframeId id : find_endless(end, parent_of)) {
    findings.add(name(id), "its odometry goes round in a cycle");
  }
}

void find_broken_covisibility(const Map& map,
                              const CopyOnWriteTable<KeyframeId, Covisibility>& counted,
                              Findings& findings) {
  counted.for_each([&](KeyframeId id, const Covisibility& covisibility) {
    if (map.covisible(id) != covisibility.edges) {
      findings.add(name(id), "covisibility counts differ");
    }
  });
}

}  // namespace

std::vector<std::string> Map::list_broken_invariants(std::size_t max_count) const {
  Findings findings(max_count);
  for (std::uint32_t i = 0; i < submaps_.size(); ++i) {
    findings.add(name(SubmapId{i}), broken_submap(*this, SubmapId{i}, submaps_[i]));
  }
  find_broken_keyframes(*this, findings);
  landmarks_.for_each([&](LandmarkId id, const Landmark& landmark) {
    if (!findings.is_full()) findings.add(name(id), broken_landmark(*this, id, landmark));
  });
  find_broken_loop_edges(*this, findings);
  find_broken_odometry(*this, findings);
  find_broken_forwarding(*this, findings);
  find_broken_covisibility(*this, count_covisibility(), findings);
  return findings.take();
}

std::string Map::broken_invariants() const {
  const std::vector<std::string> broken = list_broken_invariants(1);
  return broken.empty() ? "" : broken.front();
}

}  // namespace waymark

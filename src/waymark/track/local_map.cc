// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/local_map.h"

#include <algorithm>

namespace waymark {
namespace {

constexpr std::size_t kMaxObservers = 20;
constexpr std::size_t kMaxKeyframes = 30;
constexpr std::size_t kNeighboursPerObserver = 4;

struct Vote {
  KeyframeId keyframe;
  std::uint32_t count;
};

/// Keyframes that see the landmarks, by how many of them, most first; younger first among equals.
std::vector<Vote> count_votes(const Map& map, std::span<const LandmarkId> seen) {
  std::vector<KeyframeId> voters;
  for (LandmarkId id : seen) {
    const Landmark* landmark = map.landmarks().find(id);
    if (!landmark) continue;
    KeyframeId last;
    for (const Observation& observation : landmark->observations) {
      if (observation.keyframe != last) voters.push_back(observation.keyframe);
      last = observation.keyframe;
    }
  }
  std::sort(voters.begin(), voters.end());
  std::vector<Vote> votes;
  for (KeyframeId id : voters) {
    if (votes.empty() || votes.back().keyframe != id) votes.push_back({id, 0});
    ++votes.back().count;
  }
  std::sort(votes.begin(), votes.end(), [](const Vote& a, const Vote& b) {
    return a.count != b.count ? a.count > b.count : a.keyframe > b.keyframe;
  });
  return votes;
}

void add_neighbours(const Map& map, std::vector<KeyframeId>& keyframes) {
  const std::size_t num_observers = keyframes.size();
  for (std::size_t i = 0; i < num_observers && keyframes.size() < kMaxKeyframes; ++i) {
    for (KeyframeId id : strongest_neighbours(map, keyframes[i], kNeighboursPerObserver)) {
      if (keyframes.size() == kMaxKeyframes) break;
      if (std::find(keyframes.begin(), keyframes.end(), id) == keyframes.end()) {
        keyframes.push_back(id);
      }
    }
  }
}

}  // namespace

KeyframeId main_observer(const Map& map, std::span<const LandmarkId> seen) {
  const std::vector<Vote> votes = count_votes(map, seen);
  return votes.empty() ? KeyframeId{} : votes.front().keyframe;
}

void gather_local_map(const Map& map,
                      std::span<const LandmarkId> seen,
                      KeyframeId fallback,
                      LocalMap& local) {
  local.keyframes.clear();
  for (const Vote& vote : count_votes(map, seen)) {
    if (local.keyframes.size() == kMaxObservers) break;
    local.keyframes.push_back(vote.keyframe);
  }
  if (local.keyframes.empty()) local.keyframes.push_back(map.resolve(fallback));
  local.reference = local.keyframes.front();
  add_neighbours(map, local.keyframes);
  std::vector<LandmarkId> ids;
  for (KeyframeId keyframe : local.keyframes) {
    for (LandmarkId id : map.keyframes().at(keyframe).landmarks) {
      if (id.is_valid()) ids.push_back(id);
    }
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  local.landmarks.clear();
  for (LandmarkId id : ids) local.landmarks.add(id, map.landmarks().at(id));
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/ambiguity.h"

#include <algorithm>
#include <vector>

namespace waymark {
namespace {

/// Candidates of one query agree within this, in radians and in parts of the depth of the
/// scene.
constexpr double kMaxDisagreement = 0.2;
/// A place that fewer inliers speak for, in parts of those of the best, is no alias.
constexpr double kMinPartOfInliers = 0.5;
/// Of the drift to an alias, and of what is possible at all, where there is one: of 94 m along 20
/// equal doors the map was off by 0.06 m, while the next door was 2.5 m away.
constexpr double kMaxPartOfRivalsDrift = 0.25;
constexpr double kMaxPartOfPossibleDrift = 0.2;

/// The query in the world of the match.
Rigid3 pose_of_query(const Map& map, const LoopCandidate& candidate) {
  return pose_in_other_world(candidate.query_from_match,
                             map.keyframes().at(candidate.match).rig_from_world);
}

}  // namespace

double drift_in_depths(const Map& map, const LoopCandidate& candidate) {
  const ImpliedDrift drift = implied_drift(map, candidate);
  return drift.distance / median_depth(map, candidate.match) + drift.angle_rad;
}

bool agree(const Map& map, const LoopCandidate& a, const LoopCandidate& b) {
  if (map.keyframes().at(a.match).submap != map.keyframes().at(b.match).submap) return true;
  const Rigid3 difference = pose_of_query(map, a) * pose_of_query(map, b).inverse();
  return difference.translation.norm() < kMaxDisagreement * median_depth(map, a.match) &&
         Eigen::AngleAxisd(difference.rotation).angle() < kMaxDisagreement;
}

bool outweighs(const Map& map, const LoopCandidate& loop, double drift_of_alias) {
  return drift_in_depths(map, loop) <= kMaxPartOfRivalsDrift * drift_of_alias &&
         is_plausible_loop(map, loop, kMaxPartOfPossibleDrift);
}

bool is_alias(const LoopCandidate& place, std::size_t num_inliers_of_other) {
  return static_cast<double>(place.num_inliers) >=
         kMinPartOfInliers * static_cast<double>(num_inliers_of_other);
}

std::optional<LoopCandidate> choose_loop(const Map& map, std::span<const ScoredCandidate> loops) {
  std::size_t most_inliers = 0;
  for (const ScoredCandidate& loop : loops) {
    most_inliers = std::max(most_inliers, loop.candidate.num_inliers);
  }
  const LoopCandidate* nearest = nullptr;
  double least_drift = 0.0;
  std::vector<const LoopCandidate*> contenders;
  for (const ScoredCandidate& loop : loops) {
    const LoopCandidate& candidate = loop.candidate;
    if (!is_alias(candidate, most_inliers)) continue;
    contenders.push_back(&candidate);
    const double drift = drift_in_depths(map, candidate);
    if (nearest && drift >= least_drift) continue;
    nearest = &candidate;
    least_drift = drift;
  }
  if (!nearest || !is_plausible_loop(map, *nearest)) return std::nullopt;
  const LoopCandidate* best = nearest;
  for (const LoopCandidate* other : contenders) {
    if (!agree(map, *nearest, *other)) {
      if (!outweighs(map, *nearest, drift_in_depths(map, *other))) return std::nullopt;
    } else if (other->num_inliers > best->num_inliers && is_plausible_loop(map, *other)) {
      best = other;
    }
  }
  return *best;
}

}  // namespace waymark

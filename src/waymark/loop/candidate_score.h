// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "waymark/loop/drift.h"
#include "waymark/loop/options.h"
#include "waymark/map/map.h"
#include "waymark/match/appearance.h"
#include "waymark/match/projection.h"
#include "waymark/optimize/similarity.h"

namespace waymark {

/// How much of what should be seen is seen.
struct VisibleShare {
  std::size_t num_found = 0;
  std::size_t num_visible = 0;

  double share() const {
    return num_visible == 0 ? 0.0
                            : static_cast<double>(num_found) / static_cast<double>(num_visible);
  }
};

/// A loop candidate and what speaks for it.
struct ScoredCandidate {
  LoopCandidate candidate;
  VisibleShare in_query;  ///< Landmarks around the match in the query.
  VisibleShare in_match;  ///< Landmarks around the query in the match.
  /// Whether another keyframe near the query sees the place, too, where this candidate puts it.
  bool is_confirmed = false;
};

/// Collects by geometry what speaks for two keyframes showing the same place: how much of what they
/// see alike fits one similarity (a rigid motion where both sub-maps are metric), as Strasdat et
/// al. (2010) do, and how much of what else the two and their neighbours see that explains. Keeps
/// its buffers.
class CandidateScorer {
 public:
  explicit CandidateScorer(std::uint64_t seed, const ScoreOptions& options = {})
      : seed_(seed), options_(options) {}

  /// Nothing if no similarity fits enough matches to be looked into, or fewer than min_inliers.
  /// Repeatable by bits.
  std::optional<ScoredCandidate> score(const Map& map,
                                       KeyframeId query,
                                       KeyframeId match,
                                       std::size_t min_inliers = 0);

 private:
  LandmarkMatches match_by_appearance(const Map& map, KeyframeId query, KeyframeId match);
  std::optional<SimilarityEstimate> estimate(const Map& map, LoopCandidate& candidate);
  LandmarkMatches match_by_projection(const Map& map, LoopCandidate& candidate);
  VisibleShare look_for(const Map& map,
                        std::span<const KeyframeId> sources,
                        KeyframeId target,
                        const Rigid3& target_from_world);
  void count_visibility(const Map& map, ScoredCandidate& scored);

  std::uint64_t seed_;
  const ScoreOptions options_;
  AppearanceMatcher appearance_;
  ProjectionMatcher projection_;
  LandmarkSet landmarks_;
};

/// The rig from another rig's world, given the similarity of the two rigs: a pose in the units of
/// that world.
Rigid3 pose_in_other_world(const Sim3& rig_from_other, const Rigid3& other_from_world);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "waymark/geometry/sim3.h"
#include "waymark/map/map.h"

namespace waymark {

/// Two keyframes that show the same place, of one sub-map (a loop) or of two (a join).
struct LoopCandidate {
  /// Landmarks that are one and the same thing.
  struct Pair {
    LandmarkId of_query;
    LandmarkId of_match;
  };

  KeyframeId query;
  KeyframeId match;
  /// Of the rigs as the images say, whatever the map says; lengths in the units of the query.
  Sim3 query_from_match;
  std::vector<Pair> pairs;
  std::size_t num_inliers = 0;  ///< Matches that agree with query_from_match.
};

/// The way between two keyframes along the covisibility graph and the spanning tree.
struct GraphWay {
  double length = 0.0;  ///< In map units.
  int num_steps = 0;
};

/// The shortest way; nothing between sub-maps. Keyframes that share but a few landmarks are not
/// linked: what was seen again by chance would be a shortcut. Where the way is at least as long as
/// `enough` and has as many steps, that may come in its place. Time is that of what lies as near.
std::optional<GraphWay> shortest_way(const Map& map,
                                     KeyframeId from,
                                     KeyframeId to,
                                     const std::optional<GraphWay>& enough = std::nullopt);

/// Median distance of what a keyframe sees, in map units; 0 if that is nothing. num_landmarks: it
/// is enough to look at about so many, spread over its features.
double median_depth(const Map& map, KeyframeId id, std::size_t num_landmarks = SIZE_MAX);

/// What a loop says the map is off by: the query where the map has it against where the loop puts
/// it.
struct ImpliedDrift {
  double distance = 0.0;  ///< In map units.
  double angle_rad = 0.0;
  double log_scale = 0.0;
};
ImpliedDrift implied_drift(const Map& map, const LoopCandidate& candidate);

/// Whether a map can have drifted so far on the way that lies between query and match. Two rooms
/// that are alike are told apart by this. part: of what is possible, so much is still believed.
bool is_plausible_loop(const Map& map, const LoopCandidate& candidate, double part = 1.0);

}  // namespace waymark

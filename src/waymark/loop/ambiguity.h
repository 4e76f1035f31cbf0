// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "waymark/loop/candidate_score.h"
#include "waymark/loop/drift.h"
#include "waymark/map/map.h"

namespace waymark {

/// How far a candidate of its own sub-map says the map is off, in parts of the distance of what is
/// seen there; a radian counts as one.
double drift_in_depths(const Map& map, const LoopCandidate& candidate);

/// Whether two candidates of one query put it at the same place of the same sub-map. Those of two
/// sub-maps cannot be compared, and agree.
bool agree(const Map& map, const LoopCandidate& a, const LoopCandidate& b);

/// Whether a loop stands although another place looks the same that the map is off by
/// drift_of_alias from (drift_in_depths()): the map must be much nearer to the loop, and so near as
/// maps mostly are. There may be more such places than were found: beside each other doors and
/// shelves are seen at once, so that none is looked for at the other.
bool outweighs(const Map& map, const LoopCandidate& loop, double drift_of_alias);

/// Whether a place is an alias of another that looks like the same query: not where half as many
/// inliers do not speak for it.
bool is_alias(const LoopCandidate& place, std::size_t num_inliers_of_other);

/// Of loops of one query that looks and geometry allow, the one that explains best what is seen:
/// places for which half as many inliers speak are aliases, whether the map can have drifted so far
/// or not; where they contradict each other, the one the map drifted least to must outdo them.
/// Nothing if it does not.
std::optional<LoopCandidate> choose_loop(const Map& map, std::span<const ScoredCandidate> loops);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "waymark/loop/candidate_score.h"
#include "waymark/loop/drift.h"
#include "waymark/loop/options.h"
#include "waymark/map/map.h"
#include "waymark/place/place_index.h"
#include "waymark/track/place_locator.h"

namespace waymark {

/// Decides by geometry which candidate, if any, shows the place of a keyframe that is mapped. A
/// false candidate would spoil the map, a missed one comes again with the next keyframe. What it
/// says depends on the arguments only. Keeps its buffers.
class LoopVerifier {
 public:
  explicit LoopVerifier(std::uint64_t seed, const LoopOptions& options = {})
      : options_(options), scorer_(seed, options.scores), locator_(seed, options.neighbours) {}

  /// Looks for the place of the query by its looks, see find_alike(). They say nothing of how the
  /// two lie to each other, so that a high score is wanted, and more between sub-maps, where there
  /// is no odometry to contradict. The place must be the best explanation, see choose_loop(), also
  /// of what the match looks like: where that is to be found again elsewhere in its sub-map, it is
  /// no place to join another one, and a loop only if it outweighs() that.
  std::optional<LoopCandidate> verify_alike(const Map& map,
                                            const PlaceIndex& places,
                                            KeyframeId query);

  /// candidates: see find_spatial_neighbours(). The map says where to look, so that views are
  /// recognised from further away, and by less. Compares the first that the same cameras have seen.
  std::optional<LoopCandidate> verify_spatial_neighbours(const Map& map,
                                                         KeyframeId query,
                                                         std::span<const KeyframeId> candidates);

 private:
  std::vector<ScoredCandidate> score_alike(const Map& map,
                                           const PlaceIndex& places,
                                           KeyframeId query);
  bool is_unambiguous(const Map& map, const PlaceIndex& places, const LoopCandidate& candidate);
  std::optional<LoopCandidate> compare_with_neighbour(const Map& map,
                                                      KeyframeId query,
                                                      KeyframeId match);

  const LoopOptions options_;
  CandidateScorer scorer_;
  PlaceLocator locator_;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "waymark/loop/revisit.h"
#include "waymark/loop/revisit_verifier.h"
#include "waymark/map/map.h"
#include "waymark/place/place_index.h"

namespace waymark {

/// Recognises places that the camera comes back to, in the sub-map at hand and in others. A false
/// one would spoil the map, a missed one comes again with the next keyframe: it wants much
/// evidence, and between sub-maps, where there is no odometry to contradict, more.
class LoopFinder {
 public:
  LoopFinder(std::shared_ptr<const Rig> rig, std::uint64_t seed);

  /// To be called for each new keyframe once it is mapped; it may be in the index or not. Depends
  /// on the arguments only.
  std::optional<Revisit> find(const Map& map, const PlaceIndex& places, KeyframeId query);

 private:
  RevisitVerifier verifier_;
};

/// Keyframes of other places that look like the query, best first: none that the map links to it by
/// a few steps of covisibility, few of one place, and none that look less like it than the query's
/// own surroundings do by far.
std::vector<KeyframeId> find_candidates(const Map& map,
                                        const PlaceIndex& places,
                                        KeyframeId query,
                                        std::size_t max_count);

}  // namespace waymark

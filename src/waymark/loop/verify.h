// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "waymark/loop/drift.h"
#include "waymark/loop/evidence.h"
#include "waymark/map/map.h"
#include "waymark/place/place_index.h"
#include "waymark/track/place_locator.h"

namespace waymark {

/// Decides by geometry which candidate, if any, shows the place of a keyframe that is mapped. A
/// false revisit would spoil the map, a missed one comes again with the next keyframe. What it says
/// depends on the arguments only. Keeps its buffers.
class RevisitVerifier {
 public:
  /// rig: of the queries, see is_same_rig().
  RevisitVerifier(std::shared_ptr<const Rig> rig, std::uint64_t seed);

  /// Looks for the place of the query by its looks, see find_alike(). They say nothing of how the
  /// two lie to each other, so that much evidence is wanted, and more between sub-maps, where there
  /// is no odometry to contradict. The place must be the best explanation, see choose_loop(), also
  /// of what the match looks like: where that is to be found again elsewhere in its sub-map, it is
  /// no place to join another one, and a loop only if it outdoes() that.
  std::optional<Revisit> verify_alike(const Map& map, const PlaceIndex& places, KeyframeId query);

  /// candidates: see find_beside(). The map says where to look, so that views are recognised from
  /// further away, and by less. Compares the first that the rig has seen.
  std::optional<Revisit> verify_beside(const Map& map,
                                       KeyframeId query,
                                       std::span<const KeyframeId> candidates);

 private:
  std::vector<RevisitEvidence> collect_alike(const Map& map,
                                             const PlaceIndex& places,
                                             KeyframeId query);
  bool is_unrivalled(const Map& map, const PlaceIndex& places, const Revisit& revisit);
  std::optional<Revisit> compare_beside(const Map& map, KeyframeId query, KeyframeId match);

  std::shared_ptr<const Rig> rig_;
  EvidenceCollector evidence_;
  PlaceLocator locator_;
};

}  // namespace waymark

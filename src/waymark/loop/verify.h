// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "waymark/loop/drift.h"
#include "waymark/loop/evidence.h"
#include "waymark/map/map.h"
#include "waymark/track/place_locator.h"

namespace waymark {

/// Decides by geometry which candidate, if any, shows the place of a keyframe that is mapped. A
/// false revisit would spoil the map, a missed one comes again with the next keyframe. What it says
/// depends on the arguments only. Keeps its buffers.
class RevisitVerifier {
 public:
  /// rig: of the queries, see is_same_rig().
  RevisitVerifier(std::shared_ptr<const Rig> rig, std::uint64_t seed);

  /// candidates: see find_alike(). Their looks say nothing of how the two lie to each other, so
  /// that much evidence is wanted, and more between sub-maps, where there is no odometry to
  /// contradict.
  std::optional<Revisit> verify_alike(const Map& map,
                                      KeyframeId query,
                                      std::span<const KeyframeId> candidates);

  /// candidates: see find_beside(). The map says where to look, so that views are recognised from
  /// further away, and by less. Compares the first that the rig has seen.
  std::optional<Revisit> verify_beside(const Map& map,
                                       KeyframeId query,
                                       std::span<const KeyframeId> candidates);

 private:
  std::optional<Revisit> compare_beside(const Map& map, KeyframeId query, KeyframeId match);

  std::shared_ptr<const Rig> rig_;
  EvidenceCollector evidence_;
  PlaceLocator locator_;
};

}  // namespace waymark

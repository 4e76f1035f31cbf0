// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "waymark/loop/revisit.h"
#include "waymark/map/map.h"
#include "waymark/track/place_locator.h"

namespace waymark {

/// Finds seams of the map: keyframes that lie side by side and see the same things, but know
/// nothing of each other, as where one sub-map ended and the next began before the two were joined
/// elsewhere. The map says where to look, so that views are recognised from further away, and by
/// less, than a LoopFinder dares to. Keeps its buffers.
class LinkFinder {
 public:
  /// rig: keyframes of other rigs are left out, see is_same_rig().
  LinkFinder(std::shared_ptr<const Rig> rig, std::uint64_t seed);

  /// The nearest keyframe of the same sub-map beyond those around the query, if it shows the same.
  std::optional<Revisit> find(const Map& map, KeyframeId query);

 private:
  std::optional<Revisit> compare(const Map& map, KeyframeId query, KeyframeId match);

  const std::shared_ptr<const Rig> rig_;
  PlaceLocator locator_;
};

}  // namespace waymark

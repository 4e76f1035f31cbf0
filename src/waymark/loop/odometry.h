// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "waymark/map/correction.h"
#include "waymark/map/map.h"

namespace waymark {

/// How keyframes lie to each other by what was seen on the way, whatever loops said later. Once a
/// loop has been spread over the map, what the map says of two keyframes agrees with it; this does
/// not, so that it can still contradict. It remembers erased keyframes, too.
class Odometry {
 public:
  /// A keyframe as it was when it was noted.
  struct Node {
    KeyframeId parent;     ///< In the spanning tree then; invalid for a root.
    Sim3 rig_from_parent;  ///< Lengths in the units before any correction, as of loop edges.
    double depth = 1.0;    ///< Median distance of what it saw, in these units.
  };

  /// Notes the keyframes that are not noted yet as the map has them: to be called before a loop
  /// moves them. What a map that was loaded holds of loops is taken for what was seen on the way.
  void note(const Map& map);
  /// Per keyframe by value of its id; nothing for one that was erased before it was noted.
  const std::vector<std::optional<Node>>& nodes() const { return nodes_; }

 private:
  std::vector<std::optional<Node>> nodes_;
};

/// A loop edge as Map::measured_loop_edges() would give it.
LoopEdge as_measured(const Map& map, const LoopEdge& loop);

/// Which loops of a sub-map agree with each other and with the odometry, 1 or 0 per loop: see
/// switch_edges(). All keyframes must be noted.
/// \param loops         as Map::measured_loop_edges() gives them; of other sub-maps: 1.
/// \param num_believed  the first so many were believed before.
std::vector<std::uint8_t> choose_loops(const Map& map,
                                       const Odometry& odometry,
                                       SubmapId submap,
                                       std::span<const LoopEdge> loops,
                                       std::size_t num_believed);

/// Where odometry and loops that agree put the keyframes of a sub-map, whatever the map says now.
/// The root stays.
MapCorrection place_by_odometry(const Map& map,
                                const Odometry& odometry,
                                SubmapId submap,
                                std::span<const LoopEdge> loops);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/map/correction.h"
#include "waymark/map/map.h"

namespace waymark {

/// What closing a loop does to a map.
struct LoopPoseGraph {
  /// Where keyframes belong; of a part of the map where that is enough.
  MapCorrection correction;
  /// By how much the loop contradicts the map: the squared length in standard deviations that it
  /// takes to bend the map so that it closes, where seven are one of each unknown.
  double chi_squared = 0.0;
};

/// Where the keyframes of a sub-map belong if a loop is to close: those of a pose graph (Strasdat
/// et al. 2010) of the essential graph of Mur-Artal et al. (2015, III.D), which is the spanning
/// tree, strong covisibility and the loops so far, and of the new loop; over similarities where the
/// scale is free. The root stays.
/// The drift is spread over what lies around the ends of the loop, and nothing beyond that moves,
/// as long as the rim is hardly strained; else over four times as much, up to all of it (as
/// relative bundle adjustment does, Sibley et al. 2009). So time follows the way that a loop
/// closes, not the size of the map.
LoopPoseGraph optimize_loop(const Map& map, const LoopEdge& loop);

}  // namespace waymark

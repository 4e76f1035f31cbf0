// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/map/correction.h"
#include "waymark/map/map.h"

namespace waymark {

/// Where the keyframes of a sub-map belong if a loop is to close: those of a pose graph (Strasdat
/// et al. 2010) of the spanning tree, of strong covisibility, of the loops so far and of the new
/// one, over similarities where the scale is free. The root stays.
MapCorrection spread_drift(const Map& map, const LoopEdge& loop);

}  // namespace waymark

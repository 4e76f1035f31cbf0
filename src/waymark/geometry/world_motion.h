// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/geometry/two_view.h"

namespace waymark {

/// The relative pose of two views of the world, before which things may move: people who walk past
/// can have most of the matches. As estimate_two_view() where the matches are of one motion. Where
/// regions of the view contradict it (ViewRegions), or what it leaves out agrees on another, the
/// motion of the world is the one that most of the view agrees on: each region has as many votes,
/// however many corners what moves there has.
/// kAmbiguous where regions contradict that as well, as long as two motions are hardly apart.
TwoViewResult estimate_world_motion(const BearingMatches& matches, const TwoViewOptions& options);

}  // namespace waymark

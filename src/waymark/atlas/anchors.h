// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "waymark/atlas/atlas.h"

namespace waymark {

/// Puts the tiles to where their links say: a graph of the tiles (optimize_pose_graph()), one for
/// each part that is connected, over similarities where the scale is free. The frame of a part is
/// that of the tile of the recording that was added first, of several the one of the least
/// checksum, so that what is added later moves nothing else; tiles in metres come before others,
/// keep their scale, and give the others theirs. A place that was recognised counts
/// less the more it contradicts the rest. A pure function of tiles and links: the order in which
/// they came does not matter.
void solve_anchors(AtlasContents& contents);

/// Whether lengths are metres, by frame: one of its tiles has them.
std::vector<bool> frames_in_metres(const AtlasContents& contents);

}  // namespace waymark

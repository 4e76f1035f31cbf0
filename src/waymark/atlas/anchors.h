// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/atlas/atlas.h"

namespace waymark {

/// Puts the tiles to where their links say: a graph of the tiles (optimize_pose_graph()), one for
/// each part that is connected, over similarities where the scale is free. The frame of a part is
/// that of the tile of the recording that was added first, of several the one of the least
/// checksum, so that what is added later moves nothing else. A place that was recognised counts
/// less the more it contradicts the rest. A pure function of tiles and links: the order in which
/// they came does not matter.
void solve_anchors(AtlasContents& contents);

}  // namespace waymark

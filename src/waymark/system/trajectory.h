// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/system/system.h"
#include "waymark/track/trajectory_memory.h"

namespace waymark {

/// The frames that have a pose, as this map has it.
std::vector<TrajectoryFrame> list_poses(const TrajectoryMemory& memory, const Map& map);

/// That of each frame so far, as it is known by now.
std::vector<FrameState> list_states(const TrajectoryMemory& memory);

/// How the rig moved at the keyframes of this session, by the frames around them, of which those
/// after them were not there when they became keyframes.
std::vector<std::pair<KeyframeId, RigMotion>> list_motions(const TrajectoryMemory& memory,
                                                           const Map& map);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>

#include "waymark/map/map.h"
#include "waymark/system/inertial_smoother.h"
#include "waymark/track/trajectory_memory.h"

namespace waymark {

/// Joins two parts of a map where the camera came from one to the other within 10 s without images
/// that tell how they lie to each other, but with an IMU that does: by its state at the end of the
/// one, carried on, and the scale of each. Gives the map with them as one, the older part staying
/// where it is, and whether there were such parts; others may be left. known: of a part, with its
/// own pose_position_sigma.
bool join_parts(const TrajectoryMemory& memory,
                const std::function<InertialKnowledge(SubmapId)>& known,
                std::shared_ptr<const Map>& map);

}  // namespace waymark

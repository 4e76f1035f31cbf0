// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "waymark/imu/inertial_start.h"
#include "waymark/map/map.h"
#include "waymark/system/system.h"

namespace waymark {

/// Frames of one part of the map that an IMU is compared with, as many as are looked at.
std::vector<VisionPose> choose_poses(std::span<const TrajectoryFrame> frames, SubmapId submap);

/// How far away things are, in map units: the median over keyframes of the median of each.
double distance_of_things(const Map& map, SubmapId submap);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "waymark/imu/inertial_path.h"
#include "waymark/imu/inertial_start.h"
#include "waymark/map/map.h"
#include "waymark/track/trajectory_memory.h"

namespace waymark {

/// What a scale may be off by as a part, however many poses tell it.
inline constexpr double kSystematicScale = 0.002;
/// A scale is told where its logarithm has a smaller standard deviation.
inline constexpr double kFirmScale = 0.05;

/// What is known of an IMU in a part of the map.
struct InertialKnowledge {
  const ImuSamples& samples;
  const InertialStart& found;  ///< Of the whole way so far.
  ImuNoise noise;
  InertialStartOptions options;  ///< With how good poses of vision are.
  double distance_of_things;     ///< In map units.
  bool has_same_scale = true;    ///< As `found`, not of another part, whose scale is free.
};

/// The states of poses, with all but them as it was found of the whole way.
std::optional<InertialStart> start_again(const InertialKnowledge& known,
                                         std::span<const VisionPose> poses);

/// Whether a pose is known well enough to look for the map from there. covariance: as
/// InertialEstimate has it.
bool is_sure(const InertialKnowledge& known, const Matrix25d& covariance);

/// Makes the poses of all frames in a part of the map those that vision and IMU tell together, and
/// gives those to frames that vision did not find, as long as stretches without are short. Gives
/// the states of these frames, in map units.
std::vector<NavigationState> smooth_trajectory(const InertialKnowledge& known,
                                               SubmapId submap,
                                               const Map& map,
                                               TrajectoryMemory& memory);

}  // namespace waymark

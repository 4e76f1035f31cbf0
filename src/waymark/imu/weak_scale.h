// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "waymark/imu/inertial_refinement.h"
#include "waymark/imu/inertial_start.h"
#include "waymark/imu/linear_start.h"

namespace waymark {

/// Refines where motion hardly tells the scale. The joint maximum is no estimate there: the smaller
/// the scale, the less vision says in metres, and the better any noise fits (Neyman and Scott
/// 1948). So the posterior of the scale is integrated on a grid, with all else integrated out as if
/// normal at each scale (Tierney and Kadane 1986). Its mean and standard deviation are those of the
/// result. The motion in metres is believed to be as likely at any scale, but for first place,
/// velocity and mean acceleration, which are so in map units: that a camera stays where it is tells
/// no scale.
InertialRefinement refine_weak_scale(std::span<const VisionPose> poses,
                                     const PreintegrationChain& chain,
                                     InertialUnknowns unknowns,
                                     InertialBelief belief,
                                     const InertialStartOptions& options);

}  // namespace waymark

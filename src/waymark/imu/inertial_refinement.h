// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "waymark/imu/inertial_residual.h"
#include "waymark/imu/inertial_start.h"
#include "waymark/imu/linear_start.h"

namespace waymark {

/// What is believed of all unknowns before samples are read: normal around these values.
struct InertialBelief {
  double log_scale = 0.0;  ///< Of metres per map unit.
  double log_scale_sigma = 0.0;
  Rigid3 imu_from_rig;
  double rotation_sigma = 0.0;       ///< Of imu_from_rig, rad.
  double lever_arm_sigma = 0.0;      ///< Of its origin in the rig, m.
  double time_shift_change_s = 0.0;  ///< In relation to the one that the samples were cut at.
  double time_shift_sigma_s = 0.0;
};

/// The most likely unknowns, how sure they are and how well they fit.
struct InertialRefinement {
  InertialUnknowns unknowns;
  Matrix25d covariance;  ///< Of (setup, last state); not finite where the equations are singular.
  double squared_error = 0.0;
  double log_determinant = 0.0;  ///< Of the information of all unknowns.
};

/// Refines to the maximum of the posterior (Campos, Montiel and Tardos 2020, section III), with the
/// poses as unknowns that vision measured with noise: since neighbouring intervals share them,
/// standard deviations are honest only so. Biases walk from pose to pose.
InertialRefinement refine_inertial_start(std::span<const VisionPose> poses,
                                         const PreintegrationChain& chain,
                                         InertialUnknowns unknowns,
                                         const InertialBelief& belief,
                                         const InertialStartOptions& options);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The steps of start_inertial().

#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <vector>

#include "waymark/imu/imu.h"
#include "waymark/imu/imu_samples.h"
#include "waymark/imu/inertial_start.h"
#include "waymark/imu/preintegration.h"

namespace waymark {

/// What start_inertial() is given.
struct StartProblem {
  const ImuSamples& samples;
  std::span<const VisionPose> poses;
  const ImuCalibration& calibration;
  const ImuNoise& noise;
  const InertialStartOptions& options;

  /// What the mounting is believed to be before, and how well in rad and m.
  Rigid3 imu_from_rig() const { return calibration.imu_from_rig.value_or(Rigid3()); }
  double lever_arm_sigma() const {
    return calibration.imu_from_rig ? options.told_lever_arm_sigma : options.lever_arm_sigma;
  }
};

/// What rotations alone tell.
struct RotationStart {
  Eigen::Quaterniond imu_from_rig = Eigen::Quaterniond::Identity();
  Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Zero();  ///< rad/s.
  double time_shift_s = 0.0;
};

/// The rotation imu_from_rig and the bias that explain how the rig turned from pose to pose by how
/// the IMU did, from mean angular velocities (alignment of vectors, Umeyama 1991), robustly
/// (Huber). A time shift that is not told is where they agree best. What does not show remains as
/// told, or is near identity and 0. Nothing if no two neighbouring poses that are seen, at most 1 s
/// apart, have all
/// samples between them.
std::optional<RotationStart> rotation_start(const StartProblem& problem);

/// What samples say from pose to pose; nothing where some are missing.
struct PreintegrationChain {
  double time_shift_s = 0.0;  ///< With which they were cut.
  std::vector<std::optional<Preintegration>> intervals;
};

/// States and setup of all poses.
struct InertialUnknowns {
  std::vector<InertialState> states;
  InertialSetup setup;
};

/// The most likely unknowns, how sure they are and how well they fit.
struct InertialRefinement {
  InertialUnknowns unknowns;
  /// Of the setup and each state; not finite where the equations are singular.
  std::vector<Matrix25d> covariances;
  double squared_error = 0.0;
};

/// Refines to the maximum of the posterior (Campos, Montiel and Tardos 2020, section III), with the
/// poses as unknowns that vision measured with noise: since neighbouring intervals share them,
/// standard deviations are honest only so. Biases walk from pose to pose. log_scale_sigma: of the
/// scale that the options believe.
InertialRefinement refine_inertial_start(const StartProblem& problem,
                                         const PreintegrationChain& chain,
                                         InertialUnknowns unknowns,
                                         double log_scale_sigma);

}  // namespace waymark

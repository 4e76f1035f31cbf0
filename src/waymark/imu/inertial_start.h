// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "waymark/geometry/rigid3.h"
#include "waymark/imu/imu.h"
#include "waymark/imu/imu_samples.h"
#include "waymark/imu/inertial_residual.h"

namespace waymark {

/// A pose that vision found, or one that is looked for.
struct VisionPose {
  std::int64_t timestamp_ns = 0;  ///< By the clock of the images.
  Rigid3 rig_from_world;          ///< In map units; where it is not seen, about where it is.
  bool is_seen = true;            ///< If not, only the IMU tells it.
};

/// What is believed before any sample is read. Standard deviations are positive.
struct InertialStartOptions {
  double gravity = kStandardGravity;  ///< m/s^2.
  /// Of each pose by itself: the place of the rig in map units, per axis.
  double pose_position_sigma = 0.003;
  double pose_rotation_sigma = 0.002;  ///< rad, per axis.
  /// Errors of a pose in standard deviations, of six components, that count fully (Huber).
  double pose_huber = std::numeric_limits<double>::infinity();
  /// Logarithm of metres per map unit. A map that is metric has a small sigma.
  double log_scale = 0.0;
  double log_scale_sigma = 2.0;
  double gyroscope_bias_sigma = 0.05;     ///< rad/s.
  double accelerometer_bias_sigma = 0.2;  ///< m/s^2.
  /// Where the calibration tells imu_from_rig and the time shift, how well.
  double told_rotation_sigma = 0.005;     ///< rad.
  double told_lever_arm_sigma = 0.005;    ///< m.
  double told_time_shift_sigma_s = 5e-4;  ///< s.
  /// Where it does not, how far the IMU is from camera 0 and how far the clocks are apart.
  double lever_arm_sigma = 0.1;     ///< m.
  double time_shift_sigma_s = 0.1;  ///< s.
};

/// Where components of the tangent vectors of (setup 10, state 15) begin.
inline constexpr int kGravityAt = 0;
inline constexpr int kLogScaleAt = 2;
inline constexpr int kLeverArmAt = 3;
inline constexpr int kRotationAt = 6;
inline constexpr int kTimeShiftAt = 9;
inline constexpr int kStateAt = 10;
inline constexpr int kGyroscopeBiasAt = 19;

/// The largest standard deviation of some neighbouring components.
inline double largest_sigma(const Matrix25d& covariance, int first, int count = 3) {
  return std::sqrt(covariance.diagonal().segment(first, count).maxCoeff());
}

/// What vision and inertial samples tell together, and how well.
struct InertialStart {
  InertialSetup setup;
  double time_shift_s = 0.0;          ///< What is added to the time of an image.
  std::vector<InertialState> states;  ///< One per pose, at its time.
  /// Of the tangent vectors of (setup 10, state 15), one per state. What cannot be told has about
  /// the standard deviation that was believed before; a rotation of imu_from_rig that was not told,
  /// pi.
  std::vector<Matrix25d> covariances;
  double squared_error = 0.0;       ///< In standard deviations; at the scale that fits best.
  double degrees_of_freedom = 0.0;  ///< What squared_error is in the mean.

  /// Whether vision and IMU do not agree: residuals are thrice as large as expected, squared.
  bool is_contradicted() const { return squared_error > 3.0 * degrees_of_freedom; }
  /// Residuals that are larger than expected make all as much less sure: the factor of standard
  /// deviations.
  double less_sure() const {
    return std::sqrt(std::max(1.0, squared_error / std::max(1.0, degrees_of_freedom)));
  }
  /// With the last state.
  const Matrix25d& covariance() const { return covariances.back(); }
  /// Standard deviation of a component of the tangent vector, with the last state.
  double sigma(int component) const { return std::sqrt(covariance()(component, component)); }
};

/// Finds gravity, scale, velocities, biases, and what is not told of the calibration, from poses in
/// the order of time (a few dozen, .1 to 1 s apart) and the samples around them. No motion is asked
/// for: what it does not tell has a large standard deviation; a scale that is not told to 10 % is
/// the one believed before, as sure as that. Poses that are not seen come out as what all around
/// them tells. Two steps: rotation_start, refine_inertial_start. Nothing if no two neighbouring
/// poses that are seen have all samples between.
std::optional<InertialStart> start_inertial(const ImuSamples& samples,
                                            std::span<const VisionPose> poses,
                                            const ImuCalibration& calibration,
                                            const ImuNoise& noise,
                                            const InertialStartOptions& options);

}  // namespace waymark

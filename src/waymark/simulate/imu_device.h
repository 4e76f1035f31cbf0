// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "waymark/geometry/rigid3.h"
#include "waymark/imu/imu.h"
#include "waymark/simulate/motion.h"

namespace waymark {

/// How the three axes of a sensor measure, in rad/s or m/s^2: exactly, unless something is set.
struct ImuAxes {
  double noise_density = 0.0;  ///< Of white noise, per sqrt(Hz).
  double random_walk = 0.0;    ///< Of the bias, per second and sqrt(Hz).
  double bias = 0.0;           ///< At the start: standard deviation along each axis.
  double scale = 0.0;          ///< Standard deviation of the relative error of each axis.
  double range = std::numeric_limits<double>::infinity();  ///< Beyond it values are clipped.
};

/// A simulated inertial measurement unit: how it measures, and how it is mounted.
struct ImuDevice {
  double rate_hz = 200.0;  ///< Samples per second.
  ImuAxes gyroscope;       ///< rad/s.
  ImuAxes accelerometer;   ///< m/s^2.
  /// Standard deviation of what rotors add to the acceleration along each axis, m/s^2.
  double vibration = 0.0;
  /// By this rotation vector the IMU is turned from the axes of the rig (right, down, ahead).
  Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();
  Eigen::Vector3d lever_m = Eigen::Vector3d::Zero();  ///< Where it is in the rig.
  double time_shift_s = 0.0;  ///< Its clock, ahead of the cameras' (ImuCalibration).

  /// All that can be known of it.
  ImuCalibration calibration() const;
};

/// Names that parse_imu() knows:
///   perfect    without errors
///   mems       ADIS16448, as of EuRoC
///   phone      BMI160, as of TUM-VI
std::vector<std::string> imu_names();

/// Reads a name and then KEY=VALUE each, which replace what that says. Keys are Kalibr's
/// (update_rate, gyroscope_noise_density, gyroscope_random_walk, and the same of accelerometer_)
/// and gyroscope_bias, gyroscope_scale, gyroscope_range, the same of accelerometer_, vibration;
/// turn_x, turn_y, turn_z in degrees; lever_x, lever_y, lever_z in cm; shift in ms. Throws
/// InputError.
ImuDevice parse_imu(const std::vector<std::string>& words);

/// The samples of a whole motion, whose first moment is start_ns by the clock of the cameras; from
/// half a second before it to half a second after, as real ones begin before the first image. The
/// same seed gives the same errors whatever the motion.
std::vector<ImuSample> record_imu(const ImuDevice& imu,
                                  const Motion& motion,
                                  std::int64_t start_ns,
                                  std::uint64_t seed);

}  // namespace waymark

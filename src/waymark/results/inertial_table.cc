// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>

#include "waymark/results/results.h"

namespace waymark {

std::string format_inertial_csv(std::span<const NavigationState> states) {
  std::string text =
      "timestamp_ns,velocity_x,velocity_y,velocity_z,position_sigma,rotation_sigma,velocity_sigma,"
      "gyro_bias_x,gyro_bias_y,gyro_bias_z,accel_bias_x,accel_bias_y,accel_bias_z\n";
  const auto append = [&text](const Eigen::Vector3d& values) {
    for (const double value : values) text += fmt::format(",{:.6g}", value);
  };
  for (const NavigationState& state : states) {
    text += fmt::to_string(state.timestamp_ns);
    append(state.velocity);
    for (int part = 0; part < 3; ++part) {
      const double variance = state.covariance.diagonal().segment<3>(3 * part).mean();
      text += fmt::format(",{:.6g}", std::sqrt(variance));
    }
    append(state.biases.gyroscope);
    append(state.biases.accelerometer);
    text += "\n";
  }
  return text;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "waymark/base/rng.h"

namespace waymark {

/// What an IMU feels of four rotors and of what they make the frame do: each rotor's frequency of
/// 70 to 110 Hz, which wanders by a few percent, twice and three times of it, and noise. It shakes
/// the IMU alone: at these frequencies a camera moves by micrometres. The samples of a slow IMU
/// show it as lower frequencies, as those of one without a filter do.
class RotorVibration {
 public:
  /// acceleration: its standard deviation along each axis, m/s^2.
  RotorVibration(double acceleration, std::uint64_t seed);

  /// What is added to a measurement, in the frame of the IMU.
  struct Shake {
    Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();      ///< m/s^2.
    Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< rad/s.
  };
  /// At a time; of one after the other, because noise is drawn.
  Shake next(double seconds);

 private:
  struct Tone {
    double frequency_hz;
    double wander_hz;  ///< Of the rotor's speed, how often.
    double phase_rad;
    Shake amplitude;
  };

  double acceleration_;
  Rng rng_;
  std::vector<Tone> tones_;
};

}  // namespace waymark

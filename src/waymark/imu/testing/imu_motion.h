// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>

#include "waymark/base/rng.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/imu/imu.h"
#include "waymark/imu/imu_samples.h"
#include "waymark/imu/inertial_residual.h"

namespace waymark::testing {

inline Eigen::Vector3d normal_vector(Rng& rng) {
  return {rng.normal(), rng.normal(), rng.normal()};
}

inline std::int64_t nanoseconds(double seconds) { return std::llround(1e9 * seconds); }

/// A smooth vector by time: three waves of any direction.
struct Waves {
  std::array<Eigen::Vector3d, 3> amplitudes{
      Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  std::array<double, 3> frequencies{};  ///< rad/s.
  std::array<double, 3> phases{};

  static Waves random(double amplitude, double min_hz, double max_hz, Rng& rng) {
    Waves waves;
    for (std::size_t i = 0; i < 3; ++i) {
      waves.amplitudes[i] = amplitude / std::sqrt(1.5) * normal_vector(rng);
      waves.frequencies[i] = 2.0 * M_PI * rng.uniform(min_hz, max_hz);
      waves.phases[i] = rng.uniform(0.0, 2.0 * M_PI);
    }
    return waves;
  }
  /// The vector or a derivative of it by time.
  Eigen::Vector3d at(double t, int derivative) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < 3; ++i) {
      const double phase = frequencies[i] * t + phases[i] + 0.5 * M_PI * derivative;
      sum += std::pow(frequencies[i], derivative) * std::sin(phase) * amplitudes[i];
    }
    return sum;
  }
};

/// How an IMU moves, in closed form.
struct ImuMotion {
  Waves position;
  Waves rotation;  ///< Rotation vector after the mean attitude.
  Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();
  Eigen::Vector3d drift = Eigen::Vector3d::Zero();  ///< m/s.

  Rigid3 world_from_imu(double t) const {
    return {(attitude * so3_exp(rotation.at(t, 0))).normalized(), position.at(t, 0) + t * drift};
  }
  Eigen::Vector3d velocity(double t) const { return position.at(t, 1) + drift; }
  ImuSample true_sample(double t, const Eigen::Vector3d& gravity) const {
    const Eigen::Vector3d rate = so3_left_jacobian(-rotation.at(t, 0)) * rotation.at(t, 1);
    const Eigen::Vector3d force =
        world_from_imu(t).rotation.conjugate() * (position.at(t, 2) - gravity);
    return {nanoseconds(t), rate, force};
  }
};

inline ImuMotion hand_held_motion(Rng& rng) {
  ImuMotion motion;
  motion.position = Waves::random(0.25, 0.2, 1.0, rng);
  motion.rotation = Waves::random(0.4, 0.2, 0.8, rng);
  motion.attitude = so3_exp(normal_vector(rng));
  return motion;
}

inline ImuMotion hovering_motion(Rng& rng) {
  ImuMotion motion;
  motion.position = Waves::random(0.04, 0.2, 0.6, rng);
  motion.rotation = Waves::random(0.03, 0.2, 0.8, rng);
  motion.attitude = so3_exp(normal_vector(rng));
  return motion;
}

inline ImuMotion car_motion(Rng& rng) {
  ImuMotion motion;
  motion.position = Waves::random(0.002, 0.5, 2.0, rng);
  motion.rotation = Waves::random(0.003, 0.5, 2.0, rng);
  motion.attitude = so3_exp(normal_vector(rng));
  motion.drift = 10.0 * normal_vector(rng).normalized();
  return motion;
}

/// Samples of such a motion, with noise and biases that walk from those given.
inline ImuSamples simulated_samples(const ImuMotion& motion,
                                    double begin_s,
                                    double end_s,
                                    double rate_hz,
                                    const ImuNoise& noise,
                                    ImuBiases biases,
                                    const Eigen::Vector3d& gravity,
                                    Rng& rng) {
  ImuSamples samples;
  const double root_rate = std::sqrt(rate_hz);
  const auto count = static_cast<int>((end_s - begin_s) * rate_hz) + 1;
  for (int i = 0; i < count; ++i) {
    ImuSample sample = motion.true_sample(begin_s + i / rate_hz, gravity);
    sample.angular_velocity += biases.gyroscope + noise.gyroscope * root_rate * normal_vector(rng);
    sample.acceleration +=
        biases.accelerometer + noise.accelerometer * root_rate * normal_vector(rng);
    biases.gyroscope += noise.gyroscope_walk / root_rate * normal_vector(rng);
    biases.accelerometer += noise.accelerometer_walk / root_rate * normal_vector(rng);
    samples.add(sample);
  }
  return samples;
}

}  // namespace waymark::testing

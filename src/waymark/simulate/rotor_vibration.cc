// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/rotor_vibration.h"

#include <cmath>
#include <numbers>

namespace waymark {
namespace {

constexpr std::uint64_t kVibrationStream = std::uint64_t{1} << 42;
constexpr double kRotorTurn = 2.0 * std::numbers::pi;
constexpr int kNumRotors = 4;
constexpr int kNumHarmonics = 3;
constexpr double kWanderShare = 0.02;
/// How much a frame turns for what it shakes: a gyroscope feels 0.03 rad/s for each m/s^2.
constexpr double kTurnPerShake = 0.03;
/// Of the standard deviation of all, what is noise; the rest is the tones'.
constexpr double kNoiseShare = 0.5;

Eigen::Vector3d normal_vector(double sigma, Rng& rng) {
  const double x = rng.normal();
  const double y = rng.normal();
  return sigma * Eigen::Vector3d(x, y, rng.normal());
}

}  // namespace

RotorVibration::RotorVibration(double acceleration, std::uint64_t seed)
    : acceleration_(acceleration), rng_(seed, kVibrationStream) {
  if (acceleration <= 0.0) return;
  double power = 0.0;  // Of all axes: a sine's is half of its amplitude's square.
  for (int rotor = 0; rotor < kNumRotors; ++rotor) {
    const double frequency_hz = rng_.uniform(70.0, 110.0);
    const double wander_hz = rng_.uniform(0.2, 0.5);
    for (int harmonic = 1; harmonic <= kNumHarmonics; ++harmonic) {
      const Eigen::Vector3d push = normal_vector(1.0 / (harmonic * harmonic), rng_);
      const Eigen::Vector3d turn = normal_vector(kTurnPerShake / (harmonic * harmonic), rng_);
      power += 0.5 * push.squaredNorm();
      const double phase_rad = rng_.uniform(0.0, kRotorTurn);
      tones_.push_back({harmonic * frequency_hz, wander_hz, phase_rad, {push, turn}});
    }
  }
  const double scale = acceleration * std::sqrt((1.0 - kNoiseShare * kNoiseShare) / (power / 3.0));
  for (Tone& tone : tones_) {
    tone.amplitude.acceleration *= scale;
    tone.amplitude.angular_velocity *= scale;
  }
}

RotorVibration::Shake RotorVibration::next(double seconds) {
  Shake shake;
  if (tones_.empty()) return shake;
  shake.acceleration = normal_vector(kNoiseShare * acceleration_, rng_);
  shake.angular_velocity = normal_vector(kNoiseShare * kTurnPerShake * acceleration_, rng_);
  for (const Tone& tone : tones_) {
    // The phase is the integral of a frequency that swings by kWanderShare.
    const double wander = kWanderShare * std::sin(kRotorTurn * tone.wander_hz * seconds) /
                          (kRotorTurn * tone.wander_hz);
    const double value =
        std::sin(kRotorTurn * tone.frequency_hz * (seconds + wander) + tone.phase_rad);
    shake.acceleration += value * tone.amplitude.acceleration;
    shake.angular_velocity += value * tone.amplitude.angular_velocity;
  }
  return shake;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"
#include "waymark/simulate/imu_device.h"

namespace waymark {
namespace {

using Eigen::Vector3d;

/// Beyond those of the frames.
constexpr std::uint64_t kGyroscopeStream = std::uint64_t{1} << 40;
constexpr std::uint64_t kAccelerometerStream = std::uint64_t{1} << 41;
constexpr std::uint64_t kVibrationStream = std::uint64_t{1} << 42;

/// Three axes with their errors (the model of Kalibr's documentation, and scales): a measurement is
/// scale * truth + bias + white noise, clipped, and the bias walks.
class InertialTriad {
 public:
  InertialTriad(const ImuAxes& errors, double rate_hz, std::uint64_t seed, std::uint64_t stream)
      : errors_(errors), rate_hz_(rate_hz), rng_(seed, stream) {
    bias_ = draw(errors.bias);
    scale_ = Vector3d::Ones() + draw(errors.scale);
  }

  Vector3d measure(const Vector3d& truth) {
    // Sampling white noise of a density averages it over 1 / rate (Crassidis 2006).
    const Vector3d noise = draw(errors_.noise_density * std::sqrt(rate_hz_));
    const Vector3d value = scale_.cwiseProduct(truth) + bias_ + noise;
    bias_ += draw(errors_.random_walk / std::sqrt(rate_hz_));
    return value.cwiseMax(-errors_.range).cwiseMin(errors_.range);
  }

 private:
  Vector3d draw(double sigma) {
    const double x = rng_.normal();
    const double y = rng_.normal();
    return sigma * Vector3d(x, y, rng_.normal());
  }

  ImuAxes errors_;
  double rate_hz_;
  Rng rng_;
  Vector3d bias_;
  Vector3d scale_;
};

/// How much a frame turns for what it shakes: a gyroscope feels 0.03 rad/s for each m/s^2.
constexpr double kTurnPerShake = 0.03;

/// Of a sine that a rotor shakes an IMU with.
struct Tone {
  double rate;    ///< rad/s.
  double phase;   ///< rad.
  Vector3d push;  ///< m/s^2.
};

/// What an IMU feels of four rotors and of the frame that they shake: each one's frequency, and
/// twice and three times of it. The samples of a slow IMU show it as lower frequencies, as those of
/// one without a filter do. acceleration: standard deviation along each axis, m/s^2.
std::vector<Tone> rotor_tones(double acceleration, std::uint64_t seed) {
  Rng rng(seed, kVibrationStream);
  std::vector<Tone> tones;
  double power = 0.0;  // Of an axis: a sine's is half of its amplitude's square.
  for (int rotor = 0; rotor < 4; ++rotor) {
    const double rate = 2.0 * std::numbers::pi * rng.uniform(70.0, 110.0);
    for (int harmonic = 1; harmonic <= 3; ++harmonic) {
      const double x = rng.normal();
      const double y = rng.normal();
      const Vector3d push = Vector3d(x, y, rng.normal()) / (harmonic * harmonic);
      power += push.squaredNorm() / 6.0;
      tones.push_back({harmonic * rate, rng.uniform(0.0, 6.0), push});
    }
  }
  for (Tone& tone : tones) tone.push *= acceleration / std::sqrt(power);
  return tones;
}

/// What a perfect IMU measures; without time stamp.
ImuSample exact_imu_sample(const MotionState& state, const Rigid3& imu_from_rig) {
  const Vector3d lever = state.world_from_rig.rotation * imu_from_rig.origin_in_source();
  const Vector3d& turn = state.angular_velocity;
  Vector3d specific_force =
      state.acceleration + state.angular_acceleration.cross(lever) + turn.cross(turn.cross(lever));
  specific_force.z() += kStandardGravity;
  const Eigen::Quaterniond imu_from_world =
      imu_from_rig.rotation * state.world_from_rig.rotation.conjugate();
  ImuSample sample;
  sample.angular_velocity = imu_from_world * turn;
  sample.acceleration = imu_from_world * specific_force;
  return sample;
}

}  // namespace

std::vector<ImuSample> record_imu(const ImuDevice& imu,
                                  const Motion& motion,
                                  std::int64_t start_ns,
                                  std::uint64_t seed) {
  constexpr double kLeadSeconds = 0.5;
  WAYMARK_CHECK(imu.rate_hz > 0.0);
  const Rigid3 imu_from_rig = *imu.calibration().imu_from_rig;
  InertialTriad gyroscope(imu.gyroscope, imu.rate_hz, seed, kGyroscopeStream);
  InertialTriad accelerometer(imu.accelerometer, imu.rate_hz, seed, kAccelerometerStream);
  const std::vector<Tone> tones = rotor_tones(imu.vibration, seed);
  std::vector<ImuSample> samples;
  const std::int64_t last = std::llround(imu.rate_hz * (motion.duration_s() + kLeadSeconds));
  for (std::int64_t i = -std::llround(imu.rate_hz * kLeadSeconds); i <= last; ++i) {
    const double seconds = static_cast<double>(i) / imu.rate_hz;
    Vector3d shake = Vector3d::Zero();
    for (const Tone& tone : tones) shake += std::sin(tone.rate * seconds + tone.phase) * tone.push;
    const ImuSample exact = exact_imu_sample(motion.state(seconds), imu_from_rig);
    samples.push_back({start_ns + std::llround(1e9 * (seconds + imu.time_shift_s)),
                       gyroscope.measure(exact.angular_velocity + kTurnPerShake * shake),
                       accelerometer.measure(exact.acceleration + shake)});
  }
  return samples;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "waymark/simulate/imu_device.h"

namespace waymark {
namespace {

using Eigen::Vector3d;

constexpr std::int64_t kRecordingStartNs = 1'000'000'000;
using Recorded = std::vector<ImuSample>;

Recorded record_from_start(const ImuDevice& imu, const Motion& motion, std::uint64_t seed = 1) {
  return record_imu(imu, motion, kRecordingStartNs, seed);
}

/// The pose and the velocity of an IMU.
struct TrueState {
  Rigid3 world_from_imu;
  Vector3d velocity;
};

TrueState true_state(const ImuDevice& imu, const Motion& motion, double seconds) {
  const MotionState rig = motion.state(seconds);
  const Rigid3 rig_from_imu = imu.calibration().imu_from_rig->inverse();
  const Vector3d lever = rig.world_from_rig.rotation * rig_from_imu.translation;
  return {rig.world_from_rig * rig_from_imu, rig.velocity + rig.angular_velocity.cross(lever)};
}

/// From samples alone and where it started. Turns by the fourth-order Magnus expansion over two
/// samples, velocity and position by Simpson's rule over them (Iserles et al. 2000).
void integrate(const Recorded& samples, std::size_t first, double step_s, TrueState& flight) {
  const Vector3d& w0 = samples[first].angular_velocity;
  const Vector3d& w1 = samples[first + 1].angular_velocity;
  const Vector3d& w2 = samples[first + 2].angular_velocity;
  const double h = 2.0 * step_s;
  const Eigen::Quaterniond start = flight.world_from_imu.rotation;
  const Vector3d half = 0.5 * h * (5.0 * w0 + 8.0 * w1 - w2) / 12.0;
  const Vector3d whole = h * (w0 + 4.0 * w1 + w2) / 6.0 + h * h / 12.0 * w0.cross(w2);
  const Eigen::Quaterniond middle = start * so3_exp(half);
  const Eigen::Quaterniond end = start * so3_exp(whole);
  const Vector3d gravity(0.0, 0.0, -kStandardGravity);
  const Vector3d a0 = start * samples[first].acceleration + gravity;
  const Vector3d a1 = middle * samples[first + 1].acceleration + gravity;
  const Vector3d a2 = end * samples[first + 2].acceleration + gravity;
  flight.world_from_imu.translation += h * flight.velocity + h * h * (a0 + 2.0 * a1) / 6.0;
  flight.velocity += h * (a0 + 4.0 * a1 + a2) / 6.0;
  flight.world_from_imu.rotation = end.normalized();
}

TEST(ImuRecording, PerfectSamplesIntegrateToTheRenderedPath) {
  ImuDevice imu;
  imu.rate_hz = 1000.0;
  imu.turn_rad = {0.4, -1.2, 2.0};
  imu.lever_m = {0.3, -0.1, 0.05};
  for (const std::string& name : motion_names()) {
    SCOPED_TRACE(name);
    const double duration_s = name == "rounds" ? 60.0 : name == "thirty_rounds" ? 600.0 : 20.0;
    const Motion motion = make_motion("apartment", name, duration_s);
    const Recorded samples = record_from_start(imu, motion);
    const Rigid3 imu_from_rig = *imu.calibration().imu_from_rig;
    ASSERT_EQ(samples[500].timestamp_ns, kRecordingStartNs);
    const std::size_t start = 502;  // Where it begins and ends acceleration jumps.
    TrueState flight = true_state(imu, motion, 0.002);
    double worst_m = 0.0;
    double worst_rad = 0.0;
    for (std::size_t i = start; i < 20496; i += 2) {
      integrate(samples, i, 1e-3, flight);
      const double seconds = 1e-3 * static_cast<double>(i + 2 - 500);
      const Rigid3 rig = flight.world_from_imu * imu_from_rig;
      const Rigid3 truth = motion.world_from_rig(seconds);
      worst_m = std::max(worst_m, (rig.translation - truth.translation).norm());
      worst_rad = std::max(worst_rad, rig.rotation.angularDistance(truth.rotation));
      EXPECT_LT((true_state(imu, motion, seconds).velocity - flight.velocity).norm(), 2e-3);
    }
    EXPECT_LT(worst_m, 1e-3);
    EXPECT_LT(worst_rad, 0.01 * std::numbers::pi / 180.0);
  }
}

TEST(ImuRecording, GoesOnBeforeAndAfterTheMotion) {
  ImuDevice imu;
  imu.rate_hz = 1000.0;
  const Motion motion = make_motion("room", "loop", 20.0);
  const Recorded samples = record_from_start(imu, motion);
  TrueState flight = true_state(imu, motion, -0.5);
  for (std::size_t i = 0; i < 500; i += 2) integrate(samples, i, 1e-3, flight);
  const Rigid3 start = motion.world_from_rig(0.0);
  EXPECT_LT((flight.world_from_imu * start.inverse()).log().norm(), 1e-3);
  EXPECT_LT((flight.velocity - motion.state(0.0).velocity).norm(), 3e-3);
}

TEST(ImuRecording, AtRestItFeelsGravityUpwards) {
  ImuDevice imu;
  imu.turn_rad = {0.1, 0.7, -0.3};
  imu.lever_m = {0.2, 0.0, 0.0};
  const Motion still = make_motion("room", "still", 1.0);
  const Rigid3 world_from_imu = true_state(imu, still, 0.0).world_from_imu;
  for (const ImuSample& now : record_from_start(imu, still)) {
    EXPECT_NEAR(now.acceleration.norm(), kStandardGravity, 1e-6);
    const Vector3d upwards = world_from_imu.rotation * now.acceleration;
    EXPECT_LT((upwards - kStandardGravity * Vector3d::UnitZ()).norm(), 1e-6);
    EXPECT_LT(now.angular_velocity.norm(), 1e-9);
  }
}

/// Allan deviation of an axis at rest, for an averaging time of so many samples (IEEE Std 952).
double allan_deviation(const Recorded& samples,
                       std::size_t count,
                       const std::function<double(const ImuSample&)>& axis) {
  std::vector<double> means;
  for (std::size_t i = 0; i + count <= samples.size(); i += count) {
    double sum = 0.0;
    for (std::size_t k = i; k < i + count; ++k) sum += axis(samples[k]);
    means.push_back(sum / static_cast<double>(count));
  }
  double squares = 0.0;
  for (std::size_t i = 1; i < means.size(); ++i) squares += std::pow(means[i] - means[i - 1], 2);
  return std::sqrt(0.5 * squares / static_cast<double>(means.size() - 1));
}

TEST(ImuRecording, NoiseHasTheDensitiesItSays) {
  const Motion still = make_motion("room", "still", 2000.0);
  const auto turn = [](const ImuSample& now) { return now.angular_velocity.y(); };
  const auto push = [](const ImuSample& now) { return now.acceleration.x(); };
  for (const double rate_hz : {100.0, 400.0}) {
    ImuDevice white;
    white.rate_hz = rate_hz;
    white.gyroscope.noise_density = 1.7e-4;
    white.accelerometer.noise_density = 2.0e-3;
    const Recorded samples = record_from_start(white, still);
    const auto per_s = static_cast<std::size_t>(rate_hz);
    // The deviation at 1 s is the density, and falls by the root of the time.
    EXPECT_NEAR(allan_deviation(samples, per_s, turn), 1.7e-4, 0.05 * 1.7e-4);
    EXPECT_NEAR(allan_deviation(samples, per_s, push), 2.0e-3, 0.05 * 2.0e-3);
    EXPECT_NEAR(allan_deviation(samples, 4 * per_s, push), 1.0e-3, 0.1 * 1.0e-3);
    ImuDevice walking;
    walking.rate_hz = rate_hz;
    walking.gyroscope.random_walk = 2.0e-5;
    walking.accelerometer.random_walk = 3.0e-3;
    const Recorded walks = record_from_start(walking, still);
    // That of a walk at 3 s is its density.
    EXPECT_NEAR(allan_deviation(walks, 3 * per_s, turn), 2.0e-5, 0.1 * 2.0e-5);
    EXPECT_NEAR(allan_deviation(walks, 3 * per_s, push), 3.0e-3, 0.1 * 3.0e-3);
  }
}

TEST(ImuRecording, BiasesWalk) {
  ImuDevice imu;
  imu.gyroscope.bias = 0.01;
  imu.gyroscope.random_walk = 1e-3;
  const Motion motion = make_motion("room", "inspect", 10.0);
  const Recorded samples = record_from_start(imu, motion);
  const Recorded exact = record_from_start(ImuDevice{}, motion);
  const Vector3d first = samples[0].angular_velocity - exact[0].angular_velocity;
  const Vector3d last = samples.back().angular_velocity - exact.back().angular_velocity;
  EXPECT_GT(first.norm(), 1e-3);
  EXPECT_GT((last - first).norm(), 5e-4);
  EXPECT_EQ(samples[0].acceleration, exact[0].acceleration);
}

TEST(ImuRecording, ShiftIsWhatIsAddedToTheTimeOfAnImage) {
  ImuDevice imu;
  imu.time_shift_s = 0.02;
  const Motion motion = make_motion("room", "inspect", 10.0);
  const Recorded late = record_from_start(imu, motion);
  const Recorded usual = record_from_start(ImuDevice{}, motion);
  ASSERT_EQ(late.size(), 2201u);
  EXPECT_EQ(usual[0].timestamp_ns, kRecordingStartNs - 500'000'000);
  for (std::size_t i = 0; i < late.size(); ++i) {
    EXPECT_EQ(late[i].timestamp_ns, usual[i].timestamp_ns + 20'000'000);
    EXPECT_EQ(late[i].acceleration, usual[i].acceleration);
  }
}

TEST(ImuRecording, ClipsAtItsRangeAndScalesItsAxes) {
  const Motion motion = make_motion("room", "turns_400", 10.0);
  ImuDevice imu;
  imu.gyroscope.range = 2.0;
  double largest = 0.0;
  int num_clipped = 0;
  for (const ImuSample& now : record_from_start(imu, motion)) {
    largest = std::max(largest, now.angular_velocity.cwiseAbs().maxCoeff());
    num_clipped += now.angular_velocity.cwiseAbs().maxCoeff() == 2.0 ? 1 : 0;
  }
  EXPECT_EQ(largest, 2.0);
  EXPECT_GT(num_clipped, 50);
  ImuDevice scaled;
  scaled.accelerometer.scale = 0.01;
  const Recorded samples = record_from_start(scaled, motion);
  const Recorded exact = record_from_start(ImuDevice{}, motion);
  const Vector3d scale = samples[7].acceleration.cwiseQuotient(exact[7].acceleration);
  EXPECT_GT((scale - Vector3d::Ones()).norm(), 1e-3);
  EXPECT_LT((scale - Vector3d::Ones()).norm(), 0.05);
  for (std::size_t i = 0; i < samples.size(); i += 50) {
    EXPECT_LT((samples[i].acceleration - scale.cwiseProduct(exact[i].acceleration)).norm(), 1e-6);
  }
}

TEST(ImuRecording, VibratesAsStronglyAsItSays) {
  const Motion still = make_motion("room", "still", 20.0);
  Vector3d sum = Vector3d::Zero();
  double pushes = 0.0;
  double turns = 0.0;
  const Recorded all = record_from_start(parse_imu({"perfect", "vibration=4"}), still);
  const Recorded calm = record_from_start(ImuDevice{}, still);
  const auto count = static_cast<double>(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Vector3d shake = all[i].acceleration - calm[i].acceleration;
    sum += shake / count;
    pushes += shake.squaredNorm() / 3.0 / count;
    turns += all[i].angular_velocity.squaredNorm() / 3.0 / count;
  }
  EXPECT_NEAR(std::sqrt(pushes), 4.0, 0.15);
  EXPECT_NEAR(std::sqrt(turns), 0.12, 0.01);
  EXPECT_LT(sum.norm(), 0.05);
}

TEST(ImuRecording, IsTheSameForTheSameSeed) {
  const Motion motion = make_motion("room", "loop", 5.0);
  ImuDevice imu = parse_imu({"phone", "vibration=2"});
  const Recorded first = record_from_start(imu, motion, 7);
  const Recorded again = record_from_start(imu, motion, 7);
  const Recorded other = record_from_start(imu, motion, 8);
  ASSERT_EQ(first.size(), again.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].acceleration, again[i].acceleration);
    EXPECT_EQ(first[i].angular_velocity, again[i].angular_velocity);
    EXPECT_NE(first[i].acceleration, other[i].acceleration);
  }
}

}  // namespace
}  // namespace waymark

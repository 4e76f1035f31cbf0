// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "waymark/base/rng.h"
#include "waymark/imu/inertial_residual.h"
#include "waymark/imu/testing/imu_motion.h"

namespace waymark {
namespace {

using testing::nanoseconds;
using testing::normal_vector;

constexpr ImuNoise kPredictionNoise{2e-4, 3e-3, 3e-5, 1e-3};

struct Bridge {
  testing::ImuMotion motion;
  InertialSetup setup;
  ImuBiases biases;

  explicit Bridge(Rng& rng) : motion(testing::hand_held_motion(rng)) {
    setup.log_scale = -0.4;
    setup.imu_from_rig = {so3_exp(normal_vector(rng)), 0.1 * normal_vector(rng)};
    biases = {0.02 * normal_vector(rng), 0.2 * normal_vector(rng)};
  }
  InertialState state(double t) const {
    InertialState state;
    state.rig_from_world = (motion.world_from_imu(t) * setup.imu_from_rig).inverse();
    state.rig_from_world.translation *= std::exp(-setup.log_scale);
    state.velocity = motion.velocity(t);
    state.biases = biases;
    return state;
  }
};

TEST(ImuPrediction, FollowsTheMotion) {
  Rng rng(1, 0);
  const Bridge bridge(rng);
  const ImuSamples samples = testing::simulated_samples(
      bridge.motion, 0.0, 3.0, 1000.0, {}, bridge.biases, bridge.setup.gravity, rng);
  InertialEstimate first;
  first.state = bridge.state(0.5);
  const auto found = predict(
      first, samples, nanoseconds(0.5), nanoseconds(2.5007), kPredictionNoise, bridge.setup);
  ASSERT_TRUE(found);
  const InertialState truth = bridge.state(2.5007);
  EXPECT_LT((found->state.rig_from_world * truth.rig_from_world.inverse()).log().norm(), 1e-3);
  EXPECT_LT((found->state.velocity - truth.velocity).norm(), 1e-3);
  EXPECT_FALSE(
      predict(first, samples, nanoseconds(0.5), nanoseconds(3.1), kPredictionNoise, bridge.setup));
}

/// The squared error of the pose in standard deviations is six in the mean.
TEST(ImuPrediction, CovarianceIsHonest) {
  for (const double seconds : {0.1, 1.0, 4.0}) {
    constexpr int kTrials = 150;
    double sum = 0.0, sum_of_all = 0.0;
    for (int trial = 0; trial < kTrials; ++trial) {
      Rng rng(2, static_cast<std::uint64_t>(trial));
      Bridge bridge(rng);
      const ImuSamples samples = testing::simulated_samples(bridge.motion,
                                                            0.0,
                                                            5.0,
                                                            200.0,
                                                            kPredictionNoise,
                                                            bridge.biases,
                                                            bridge.setup.gravity,
                                                            rng);
      Vector15d sigmas;
      sigmas << 0.003, 0.003, 0.003, 0.002, 0.002, 0.002, 0.03, 0.03, 0.03, 0.002, 0.002, 0.002,
          0.05, 0.05, 0.05;
      Vector15d error;
      for (int i = 0; i < 15; ++i) error[i] = sigmas[i] * rng.normal();
      InertialEstimate first;
      first.state = bridge.state(0.0).moved(error);
      first.covariance.diagonal().tail<15>() = sigmas.cwiseAbs2();
      // Gravity, scale and mounting are not known exactly, either.
      Vector10d setup_sigmas;
      setup_sigmas << 0.002, 0.002, 0.01, 0.005, 0.005, 0.005, 0.002, 0.002, 0.002, 0.0;
      Vector10d setup_error;
      for (int i = 0; i < 10; ++i) setup_error[i] = setup_sigmas[i] * rng.normal();
      first.covariance.diagonal().head<10>() = setup_sigmas.cwiseAbs2();
      const InertialSetup setup = bridge.setup.moved(setup_error);
      const auto found = predict(first, samples, 0, nanoseconds(seconds), kPredictionNoise, setup);
      ASSERT_TRUE(found);
      const InertialState truth = bridge.state(seconds);
      const Vector6d off = (found->state.rig_from_world * truth.rig_from_world.inverse()).log();
      sum += off.dot(found->covariance.block<6, 6>(10, 10).ldlt().solve(off));
      Eigen::Matrix<double, 9, 1> all;
      all << off, found->state.velocity - truth.velocity;
      sum_of_all += all.dot(found->covariance.block<9, 9>(10, 10).ldlt().solve(all));
    }
    RecordProperty("nees_" + std::to_string(seconds), std::to_string(sum / kTrials));
    EXPECT_GT(sum / kTrials, 5.2) << seconds;
    EXPECT_LT(sum / kTrials, 6.9) << seconds;
    EXPECT_NEAR(sum_of_all / kTrials, 9.0, 1.2) << seconds;
  }
}

}  // namespace
}  // namespace waymark

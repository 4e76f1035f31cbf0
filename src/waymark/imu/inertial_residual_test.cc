// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/inertial_residual.h"

#include <gtest/gtest.h>

#include "waymark/base/rng.h"
#include "waymark/imu/testing/imu_motion.h"

namespace waymark {
namespace {

using testing::nanoseconds;
using testing::normal_vector;

constexpr ImuNoise kResidualNoise{1e-3, 1e-2, 1e-4, 1e-3};

struct Scene {
  testing::ImuMotion motion;
  InertialSetup setup;
  ImuBiases biases;

  explicit Scene(Rng& rng) : motion(testing::hand_held_motion(rng)) {
    setup.gravity = kStandardGravity * normal_vector(rng).normalized();
    setup.log_scale = 0.7;
    setup.imu_from_rig = {so3_exp(normal_vector(rng)), 0.1 * normal_vector(rng)};
    biases = {0.02 * normal_vector(rng), 0.2 * normal_vector(rng)};
  }
  InertialState state(double image_s, double velocity_s) const {
    InertialState state;
    state.rig_from_world = (motion.world_from_imu(image_s) * setup.imu_from_rig).inverse();
    state.rig_from_world.translation *= std::exp(-setup.log_scale);
    state.velocity = motion.velocity(velocity_s);
    state.biases = biases;
    return state;
  }
  Preintegration preintegration(double begin_s, double end_s, double rate_hz) const {
    Rng rng(0, 0);
    const ImuSamples samples = testing::simulated_samples(
        motion, begin_s - 0.1, end_s + 0.1, rate_hz, {}, biases, setup.gravity, rng);
    return {samples.between(nanoseconds(begin_s), nanoseconds(end_s)), kResidualNoise, biases};
  }
};

TEST(InertialResidual, VanishesForTheTrueMotion) {
  Rng rng(1, 0);
  for (int trial = 0; trial < 5; ++trial) {
    const Scene scene(rng);
    const auto residual = inertial_residual(scene.preintegration(0.2, 0.6, 2000.0),
                                            scene.state(0.2, 0.2),
                                            scene.state(0.6, 0.6),
                                            scene.setup);
    EXPECT_LT(residual.value.norm(), 1e-2);
  }
}

TEST(InertialResidual, AShiftOfTimeIsMadeUpForToFirstOrder) {
  Rng rng(2, 0);
  Scene scene(rng);
  const auto preintegration = scene.preintegration(0.2, 0.6, 2000.0);
  const auto residual_at = [&](double shift, double told) {
    scene.setup.time_shift_change_s = told;
    return inertial_residual(preintegration,
                             scene.state(0.2 + shift, 0.2),
                             scene.state(0.6 + shift, 0.6),
                             scene.setup)
        .value.norm();
  };
  // Images are 2 ms later by the clock of the IMU than the samples end.
  EXPECT_GT(residual_at(0.002, 0.0), 20.0 * residual_at(0.002, 0.002));
  EXPECT_NEAR(residual_at(0.004, 0.004) / residual_at(0.002, 0.002), 4.0, 0.3);
}

/// All derivatives against differences, away from where residuals vanish.
TEST(InertialResidual, DerivativesMatchNumericOnes) {
  Rng rng(3, 0);
  for (int trial = 0; trial < 10; ++trial) {
    const Scene scene(rng);
    const auto preintegration = scene.preintegration(0.2, 0.6, 200.0);
    Vector15d off;
    for (double& value : off) value = 0.05 * rng.normal();
    const InertialState first = scene.state(0.2, 0.2).moved(off);
    const InertialState second = scene.state(0.6, 0.6).moved(-0.7 * off);
    InertialSetup setup = scene.setup;
    setup.time_shift_change_s = trial % 2 == 0 ? 0.0 : 0.02;
    const InertialResidual center = inertial_residual(preintegration, first, second, setup);
    const double step = 1e-6;
    const auto check = [&](const auto& analytic, const auto& residual_of) {
      for (Eigen::Index i = 0; i < analytic.cols(); ++i) {
        const Vector15d numeric = (residual_of(i, step) - residual_of(i, -step)) / (2.0 * step);
        EXPECT_LT((analytic.col(i) - numeric).norm(), 1e-6 * (10.0 + analytic.norm())) << i;
        EXPECT_LT((analytic.col(i) - numeric).norm(), 1e-4 * (1.0 + numeric.norm())) << i;
      }
    };
    check(center.by_first, [&](Eigen::Index i, double h) {
      return inertial_residual(preintegration, first.moved(h * Vector15d::Unit(i)), second, setup)
          .value;
    });
    check(center.by_second, [&](Eigen::Index i, double h) {
      return inertial_residual(preintegration, first, second.moved(h * Vector15d::Unit(i)), setup)
          .value;
    });
    check(center.by_setup, [&](Eigen::Index i, double h) {
      return inertial_residual(preintegration, first, second, setup.moved(h * Vector10d::Unit(i)))
          .value;
    });
  }
}

TEST(InertialResidual, PerturbationsKeepTheSizeOfGravity) {
  const InertialSetup setup;
  const InertialSetup moved = setup.moved(0.3 * Vector10d::Ones());
  EXPECT_NEAR(moved.gravity.norm(), kStandardGravity, 1e-12);
  EXPECT_NEAR(moved.gravity.normalized().dot(setup.gravity.normalized()),
              std::cos(0.3 * std::sqrt(2.0)),
              1e-12);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/preintegration.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/imu/testing/imu_motion.h"

namespace waymark {
namespace {

using testing::ImuMotion;

constexpr ImuNoise kNoise{1e-3, 1e-2, 1e-3, 1e-2};
const Eigen::Vector3d kMotionGravity(0.3, 0.2, -9.8);

std::vector<ImuSample> true_samples(const ImuMotion& motion, double begin, double end, int count) {
  std::vector<ImuSample> samples;
  for (int i = 0; i <= count; ++i) {
    samples.push_back(motion.true_sample(begin + (end - begin) * i / count, kMotionGravity));
  }
  return samples;
}

/// What the motion itself says, without any integration.
InertialDelta true_delta(const ImuMotion& motion, double begin, double end) {
  const Rigid3 a = motion.world_from_imu(begin), b = motion.world_from_imu(end);
  const Eigen::Quaterniond back = a.rotation.conjugate();
  const double t = end - begin;
  return {back * b.rotation,
          back * (motion.velocity(end) - motion.velocity(begin) - t * kMotionGravity),
          back * (b.translation - a.translation - t * motion.velocity(begin) -
                  0.5 * t * t * kMotionGravity)};
}

using Vector9d = Eigen::Matrix<double, 9, 1>;

Vector9d difference(const InertialDelta& a, const InertialDelta& b) {
  Vector9d result;
  result << so3_log(b.rotation.conjugate() * a.rotation), a.velocity - b.velocity,
      a.position - b.position;
  return result;
}

TEST(Preintegration, ErrorsAreOfSecondOrderInTheStep) {
  Rng rng(1, 0);
  for (int trial = 0; trial < 5; ++trial) {
    const ImuMotion motion = testing::hand_held_motion(rng);
    const InertialDelta truth = true_delta(motion, 0.3, 1.3);
    std::vector<Vector9d> errors;
    for (const int count : {50, 100, 200}) {
      errors.push_back(difference(
          Preintegration(true_samples(motion, 0.3, 1.3, count), kNoise, {}).delta(), truth));
    }
    for (const int row : {0, 3, 6}) {
      const auto size = [&](int i) { return errors[i].segment<3>(row).norm(); };
      EXPECT_NEAR(std::log2(size(0) / size(1)), 2.0, 0.1) << row;
      EXPECT_NEAR(std::log2(size(1) / size(2)), 2.0, 0.1) << row;
    }
    EXPECT_LT(errors[2].norm(), 2e-3);
  }
}

TEST(Preintegration, DerivativesByBiasesAreThoseOfIntegration) {
  Rng rng(2, 0);
  const ImuMotion motion = testing::hand_held_motion(rng);
  const auto samples = true_samples(motion, 0.0, 0.5, 100);
  const ImuBiases biases{{0.02, -0.01, 0.03}, {0.1, 0.2, -0.3}};
  const Preintegration center(samples, kNoise, biases);
  for (int i = 0; i < 6; ++i) {
    const double step = 1e-5;
    ImuBiases more = biases, less = biases;
    Eigen::Vector3d& up = i < 3 ? more.gyroscope : more.accelerometer;
    Eigen::Vector3d& down = i < 3 ? less.gyroscope : less.accelerometer;
    up[i % 3] += step;
    down[i % 3] -= step;
    const InertialDelta a = Preintegration(samples, kNoise, more).delta();
    const InertialDelta b = Preintegration(samples, kNoise, less).delta();
    Vector9d numeric = difference(a, b) / (2.0 * step);
    EXPECT_LT((numeric - center.by_biases().col(i)).norm(), 1e-7) << i;
  }
}

TEST(Preintegration, DerivativesByScalesOfAxesAreThoseOfIntegration) {
  Rng rng(2, 0);
  const auto samples = true_samples(testing::hand_held_motion(rng), 0.0, 0.5, 100);
  const ImuBiases biases{{0.02, -0.01, 0.03}, {0.1, 0.2, -0.3}};
  const Preintegration center(samples, kNoise, biases);
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 6; ++i) {
    auto smaller = samples, larger = samples;
    for (std::size_t k = 0; k < samples.size(); ++k) {
      for (auto& [changed, sign] : {std::pair(&smaller[k], -1.0), std::pair(&larger[k], 1.0)}) {
        double& rate = i < 3 ? changed->angular_velocity[i] : changed->acceleration[i - 3];
        rate += sign * kStep * (rate - (i < 3 ? biases.gyroscope[i] : biases.accelerometer[i - 3]));
      }
    }
    const InertialDelta a = Preintegration(smaller, kNoise, biases).delta();
    const InertialDelta b = Preintegration(larger, kNoise, biases).delta();
    const Vector9d numeric = difference(a, b) / (2.0 * kStep);
    // The mean force of a step stands for both of its ends.
    EXPECT_LT((numeric - center.by_scales().col(i)).norm(), 2e-3) << i;
    EXPECT_GT(numeric.norm(), 0.02) << i;
  }
}

TEST(Preintegration, ChangedBiasesAreExactToFirstOrderAndExactlyIntegratedWhenFar) {
  Rng rng(3, 0);
  const auto samples = true_samples(testing::hand_held_motion(rng), 0.0, 0.5, 100);
  Preintegration integrated(samples, kNoise, {});
  const Eigen::Vector3d direction = testing::normal_vector(rng).normalized();
  std::vector<double> errors;
  for (const double size : {0.004, 0.008}) {
    const ImuBiases near{size * direction, size * direction};
    errors.push_back(
        difference(integrated.delta_with(near), Preintegration(samples, kNoise, near).delta())
            .norm());
    EXPECT_FALSE(integrated.reintegrate_if_far(near));
  }
  EXPECT_NEAR(errors[1] / errors[0], 4.0, 0.2);
  EXPECT_LT(errors[1], 2e-4);
  const ImuBiases far{0.3 * direction, direction};
  EXPECT_TRUE(integrated.reintegrate_if_far(far));
  const InertialDelta exact = Preintegration(samples, kNoise, far).delta();
  EXPECT_LT(difference(integrated.delta_with(far), exact).norm(), 1e-14);
  EXPECT_EQ(integrated.biases().gyroscope, far.gyroscope);
}

/// Squared error in standard deviations, with the walk of the biases.
TEST(Preintegration, CovarianceIsThatOfManyNoisyIntegrations) {
  Rng rng(4, 0);
  const ImuMotion motion = testing::hand_held_motion(rng);
  // Walks as large as what they add counts.
  const ImuNoise noise{1e-3, 1e-2, 2e-3, 3e-2};
  const double root_rate = std::sqrt(200.0);
  const auto exact = true_samples(motion, 0.0, 1.0, 200);
  const InertialDelta truth = Preintegration(exact, noise, {}).delta();
  constexpr int kTrials = 400;
  Matrix15d scatter = Matrix15d::Zero();
  for (int trial = 0; trial < kTrials; ++trial) {
    ImuBiases biases;
    auto samples = exact;
    for (ImuSample& sample : samples) {
      sample.angular_velocity +=
          biases.gyroscope + noise.gyroscope * root_rate * testing::normal_vector(rng);
      sample.acceleration +=
          biases.accelerometer + noise.accelerometer * root_rate * testing::normal_vector(rng);
      biases.gyroscope += noise.gyroscope_walk / root_rate * testing::normal_vector(rng);
      biases.accelerometer += noise.accelerometer_walk / root_rate * testing::normal_vector(rng);
    }
    const Preintegration noisy(samples, noise, {});
    Vector15d error;
    // What is true by what was measured.
    error << difference(truth, noisy.delta()), biases.gyroscope, biases.accelerometer;
    const Vector15d white = noisy.square_root_information() * error;
    scatter += white * white.transpose() / kTrials;
  }
  EXPECT_NEAR(scatter.trace(), 15.0, 0.6);
  EXPECT_LT((scatter - Matrix15d::Identity()).cwiseAbs().maxCoeff(), 0.25);
}

TEST(Preintegration, RootOfInformationIsThatOfTheCovariance) {
  Rng rng(5, 0);
  const ImuMotion motion = testing::hand_held_motion(rng);
  for (const int count : {1, 2, 50}) {  // Even a single step has a covariance of full rank.
    const Preintegration integrated(true_samples(motion, 0.0, 0.005 * count, count), kNoise, {});
    const Matrix15d& root = integrated.square_root_information();
    const Matrix15d whitened = root * integrated.covariance() * root.transpose();
    EXPECT_LT((whitened - Matrix15d::Identity()).norm(), 1e-6);
    const double seconds = integrated.duration_s();
    EXPECT_NEAR(integrated.covariance()(9, 9), 1e-6 * seconds, 1e-15);
    EXPECT_NEAR(
        integrated.covariance()(0, 0), 1e-6 * seconds, 4e-7 * seconds * seconds * seconds + 1e-15);
  }
}

TEST(Preintegration, HoldsForANanosecondAndForAMinute) {
  Rng rng(6, 0);
  const ImuMotion motion = testing::hand_held_motion(rng);
  for (const double seconds : {1e-9, 1e-6, 60.0}) {
    const int count = seconds < 1.0 ? 1 : 60000;
    const Preintegration integrated(true_samples(motion, 0.0, seconds, count), kNoise, {});
    EXPECT_TRUE(integrated.square_root_information().allFinite()) << seconds;
    EXPECT_NEAR(integrated.delta().rotation.norm(), 1.0, 1e-12);
  }
}

TEST(Preintegration, BrokenPromisesFail) {
  const auto samples = true_samples({}, 0.0, 0.1, 20);
  EXPECT_THROW(Preintegration({samples[0]}, kNoise, {}), CheckError);
  EXPECT_THROW(Preintegration({samples[1], samples[0]}, kNoise, {}), CheckError);
  EXPECT_THROW(Preintegration(samples, {}, {}), CheckError);
}

}  // namespace
}  // namespace waymark

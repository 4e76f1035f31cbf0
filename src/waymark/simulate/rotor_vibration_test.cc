// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/rotor_vibration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace waymark {
namespace {

using Eigen::Vector3d;

constexpr double kShakesPerSecond = 1000.0;

std::vector<RotorVibration::Shake> shakes(double acceleration, std::uint64_t seed) {
  RotorVibration vibration(acceleration, seed);
  std::vector<RotorVibration::Shake> result;
  for (int i = 0; i < 20000; ++i) result.push_back(vibration.next(i / kShakesPerSecond));
  return result;
}

TEST(RotorVibration, IsAsStrongAsItSaysAndHasNoMean) {
  Vector3d sum = Vector3d::Zero();
  double squares = 0.0;
  double turns = 0.0;
  const auto all = shakes(4.0, 5);
  for (const RotorVibration::Shake& shake : all) {
    sum += shake.acceleration;
    squares += shake.acceleration.squaredNorm() / 3.0;
    turns += shake.angular_velocity.squaredNorm() / 3.0;
  }
  const auto count = static_cast<double>(all.size());
  EXPECT_NEAR(std::sqrt(squares / count), 4.0, 0.15);
  EXPECT_LT((sum / count).norm(), 0.05);
  EXPECT_GT(std::sqrt(turns / count), 0.05);
  EXPECT_LT(std::sqrt(turns / count), 0.25);
}

TEST(RotorVibration, HasItsPowerWhereRotorsTurn) {
  const auto all = shakes(4.0, 5);
  // Share of the signal's power in a band, by its Fourier sums.
  const auto power = [&](double low_hz, double high_hz) {
    double sum = 0.0;
    for (double hz = low_hz; hz < high_hz; hz += 0.05) {
      double real = 0.0;
      double imaginary = 0.0;
      for (std::size_t i = 0; i < all.size(); i += 1) {
        const double angle =
            2.0 * std::numbers::pi * hz * static_cast<double>(i) / kShakesPerSecond;
        real += all[i].acceleration.x() * std::cos(angle);
        imaginary += all[i].acceleration.x() * std::sin(angle);
      }
      sum += real * real + imaginary * imaginary;
    }
    return sum;
  };
  EXPECT_GT(power(68.0, 113.0), 10.0 * power(10.0, 55.0));
}

TEST(RotorVibration, IsTheSameForTheSameSeed) {
  const auto first = shakes(1.0, 1);
  const auto again = shakes(1.0, 1);
  EXPECT_EQ(first[999].acceleration, again[999].acceleration);
  EXPECT_NE(first[999].acceleration, shakes(1.0, 2)[999].acceleration);
  EXPECT_EQ(shakes(0.0, 1)[999].acceleration, Vector3d::Zero());
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/solver/residual.h"

#include <gtest/gtest.h>

#include <limits>

#include "waymark/solver/testing/scene.h"

namespace waymark {
namespace {

TEST(Residual, DerivativesMatchDifferences) {
  Rng rng(1, 0);
  const double step = 1e-6;
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::Vector3d point = testing::random_vector(rng, 4.0);
    const auto measured = testing::measure(point + testing::random_vector(rng, 0.2), 1.0, rng);
    const auto& w = measured.level_pixel_from_bearing;
    const Matrix23d by_point = bearing_residual_by_point(in_inverse_range(point), w);
    const Eigen::RowVector3d range_by_point =
        range_residual_by_point(in_inverse_range(point), 0.02);
    const Eigen::RowVector3d depth_by_point =
        depth_residual_by_point(in_inverse_range(point), 0.02);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d offset = step * Eigen::Vector3d::Unit(axis);
      const InverseRangePoint plus = in_inverse_range(point + offset);
      const InverseRangePoint minus = in_inverse_range(point - offset);
      const Eigen::Vector2d numeric = (bearing_residual(plus, measured.bearing, w) -
                                       bearing_residual(minus, measured.bearing, w)) /
                                      (2.0 * step);
      EXPECT_NEAR((by_point.col(axis) - numeric).norm(), 0.0, 1e-4 * (1.0 + numeric.norm()));
      const double range_numeric =
          (range_residual(plus, 0.1, 0.02) - range_residual(minus, 0.1, 0.02)) / (2.0 * step);
      EXPECT_NEAR(range_by_point[axis], range_numeric, 1e-4 * (1.0 + std::abs(range_numeric)));
      const double depth_numeric =
          (depth_residual(plus, 0.1, 0.02) - depth_residual(minus, 0.1, 0.02)) / (2.0 * step);
      EXPECT_NEAR(depth_by_point[axis], depth_numeric, 1e-4 * (1.0 + std::abs(depth_numeric)));
    }
  }
}

TEST(Residual, CountsPixelsOfTheTangentPlane) {
  const Eigen::Vector3d bearing = Eigen::Vector3d(0.3, -0.4, 1.0).normalized();
  const Matrix23f w = testing::pixel_from_bearing(bearing, 500.0).cast<float>();
  const Eigen::Vector3d side = bearing.cross(Eigen::Vector3d::UnitY()).normalized();
  const Eigen::Vector3d point = 7.0 * (bearing + side * (3.0 / 500.0));
  EXPECT_NEAR(
      bearing_residual(in_inverse_range(point), bearing.cast<float>(), w).norm(), 3.0, 1e-3);
}

TEST(Residual, TheAntipodeIsNotAhead) {
  const Eigen::Vector3f bearing(0.0f, 0.6f, 0.8f);
  EXPECT_TRUE(is_ahead(in_inverse_range({0.0, 3.0, 4.0}), bearing));
  EXPECT_FALSE(is_ahead(in_inverse_range({0.0, -3.0, -4.0}), bearing));
  EXPECT_FALSE(is_ahead(in_inverse_range(Eigen::Vector3d::Zero()), bearing));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(is_ahead(in_inverse_range({nan, 0.0, 1.0}), bearing));
}

}  // namespace
}  // namespace waymark

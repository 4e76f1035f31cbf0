// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/pixel_angles.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "waymark/camera/equirectangular.h"
#include "waymark/camera/perspective.h"

namespace waymark {
namespace {

/// Geometric mean of the angles between the rays half a pixel to each side, along rows and columns.
double measured_angle(const Camera& camera, const Eigen::Vector2d& pixel) {
  const std::vector<Eigen::Vector2d> pixels = {pixel - Eigen::Vector2d(0.5, 0.0),
                                               pixel + Eigen::Vector2d(0.5, 0.0),
                                               pixel - Eigen::Vector2d(0.0, 0.5),
                                               pixel + Eigen::Vector2d(0.0, 0.5)};
  std::vector<Eigen::Vector3d> rays(4);
  std::vector<std::uint8_t> is_valid(4);
  camera.unproject(pixels, rays, is_valid);
  const Eigen::Vector3d along_row = rays[1] - rays[0];
  const Eigen::Vector3d along_column = rays[3] - rays[2];
  return std::sqrt(along_row.cross(along_column).norm());
}

TEST(PixelAngles, AreWhatUnprojectedRaysSpanNearby) {
  // The size is no multiple of the table's cells.
  const PerspectiveCamera camera(PerspectiveModel({420.0, 400.0}, {330.0, 230.0}), 643, 485);
  const PixelAngles angles(camera);
  for (const double x : {0.0, 100.0, 321.0, 500.0, 642.0}) {
    for (const double y : {0.0, 150.0, 242.0, 484.0}) {
      // Within a cell of 16 pixels the angle changes by a few percent.
      EXPECT_NEAR(angles.at({x, y}) / measured_angle(camera, {x, y}), 1.0, 0.04) << x << " " << y;
    }
  }
}

TEST(PixelAngles, AtTheCentreIsTheInverseOfTheFocalLength) {
  const PerspectiveCamera camera(PerspectiveModel({420.0, 420.0}, {319.5, 239.5}), 640, 480);
  EXPECT_NEAR(central_pixel_angle(camera), 1.0 / 420.0, 1e-5);
}

TEST(PixelAngles, ColumnsOfWholeSpheresStretchTowardsThePoles) {
  const EquirectangularCamera camera(EquirectangularModel(1280, 640), 1280, 640);
  const PixelAngles angles(camera);
  EXPECT_NEAR(angles.column_stretch({-0.5, 319.5}), 1.0, 0.01);
  // At the latitude of 60 degrees two columns span what a row does.
  EXPECT_NEAR(angles.column_stretch({1279.4, 319.5 + 640.0 / 3.0}), 2.0, 0.15);
  EXPECT_GT(angles.column_stretch({640.0, 0.0}), 10.0);
  const PerspectiveCamera plain(PerspectiveModel({420.0, 420.0}, {319.5, 239.5}), 640, 480);
  EXPECT_EQ(PixelAngles(plain).column_stretch({0.0, 0.0}), 1.0);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What every camera model has to pass, in a test of GoogleTest.
//
//   TEST(MyCamera, IsACamera) {
//     CameraDescription description;
//     description.camera_model = "pinhole";
//     description.intrinsics = {400.0, 400.0, 320.0, 240.0};
//     description.width_px = 640;
//     description.height_px = 480;
//     expect_camera_is_sound(*CameraRegistry::with_builtin_models().make_camera(description));
//   }

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/camera/camera.h"

namespace waymark {

/// Bounds of expect_camera_is_sound; the defaults suit every model of this library.
struct CameraTestOptions {
  /// Largest error of project(unproject(pixel)).
  double pixel_tolerance_px = 1e-7;
  /// Largest angle between a direction and unproject(project(direction)).
  double angle_tolerance_rad = 1e-9;
  /// Largest error of the Jacobian, relative to its largest element.
  double jacobian_tolerance = 1e-5;
  /// Smallest part of the image's pixels that must have a bearing.
  double min_valid_part = 0.5;
};

/// What the functions below see of a camera: results of one call for a whole array.
struct CameraTestProjection {
  std::vector<Eigen::Vector2d> pixels;  ///< Per point.
  std::vector<Matrix23d> jacobians;     ///< Per point: d pixel / d point, px/m.
  /// Per point: 1 where the pixel and the Jacobian mean something.
  std::vector<std::uint8_t> is_visible;
};

/// Projects all points, in metres in the frame of the camera, in one call.
inline CameraTestProjection project_for_test(const Camera& camera,
                                             const std::vector<Eigen::Vector3d>& points) {
  CameraTestProjection result{std::vector<Eigen::Vector2d>(points.size()),
                              std::vector<Matrix23d>(points.size()),
                              std::vector<std::uint8_t>(points.size())};
  camera.project_with_jacobian(points, result.pixels, result.jacobians, result.is_visible);
  return result;
}

/// Pixels on a grid over the whole image, the outermost pixel centres included.
inline std::vector<Eigen::Vector2d> pixel_grid_for_test(const Camera& camera, int num_per_axis) {
  std::vector<Eigen::Vector2d> pixels;
  for (int row = 0; row < num_per_axis; ++row) {
    for (int column = 0; column < num_per_axis; ++column) {
      pixels.emplace_back((camera.width_px() - 1.0) * column / (num_per_axis - 1),
                          (camera.height_px() - 1.0) * row / (num_per_axis - 1));
    }
  }
  return pixels;
}

/// Points in all directions, 0.1 to 100 m away.
inline std::vector<Eigen::Vector3d> random_points_for_test(int num_points, std::uint64_t seed) {
  Rng rng(seed, 0);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < num_points; ++i) {
    const Eigen::Vector3d direction(rng.normal(), rng.normal(), rng.normal());
    points.push_back(direction.normalized() * std::pow(10.0, rng.uniform(-1.0, 2.0)));
  }
  return points;
}

/// Distance of two pixels, across the seam where columns repeat.
inline double pixel_distance_for_test(const Camera& camera,
                                      const Eigen::Vector2d& a,
                                      const Eigen::Vector2d& b) {
  Eigen::Vector2d difference = a - b;
  if (const double wrap = camera.wrap_width_px(); wrap > 0.0) {
    difference.x() -= wrap * std::round(difference.x() / wrap);
  }
  return difference.norm();
}

/// project(unproject(pixel)) is the pixel all over the image, and bearings have unit length.
inline void expect_pixels_survive(const Camera& camera, const CameraTestOptions& options) {
  const std::vector<Eigen::Vector2d> pixels = pixel_grid_for_test(camera, 61);
  std::vector<Eigen::Vector3d> bearings(pixels.size());
  std::vector<std::uint8_t> is_valid(pixels.size());
  camera.unproject(pixels, bearings, is_valid);
  const CameraTestProjection back = project_for_test(camera, bearings);
  std::size_t num_valid = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!is_valid[i]) continue;
    ++num_valid;
    EXPECT_NEAR(bearings[i].norm(), 1.0, 1e-12) << "pixel " << pixels[i].transpose();
    const bool is_on_edge = (pixels[i].array() <= 0.0).any() ||
                            pixels[i].x() >= camera.width_px() - 1.0 ||
                            pixels[i].y() >= camera.height_px() - 1.0;
    if (is_on_edge && !back.is_visible[i]) continue;  // The field of view may end just here.
    EXPECT_TRUE(back.is_visible[i]) << "pixel " << pixels[i].transpose();
    EXPECT_LT(pixel_distance_for_test(camera, back.pixels[i], pixels[i]),
              options.pixel_tolerance_px)
        << "pixel " << pixels[i].transpose();
  }
  EXPECT_GE(static_cast<double>(num_valid),
            options.min_valid_part * static_cast<double>(pixels.size()));
}

/// unproject(project(point)) is the direction of every visible point, within the image.
inline void expect_directions_survive(const Camera& camera, const CameraTestOptions& options) {
  const std::vector<Eigen::Vector3d> points = random_points_for_test(20000, 1);
  const CameraTestProjection projection = project_for_test(camera, points);
  std::vector<Eigen::Vector3d> bearings(points.size());
  std::vector<std::uint8_t> is_valid(points.size());
  std::vector<Eigen::Vector2d> pixels = projection.pixels;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!projection.is_visible[i]) pixels[i].setZero();
  }
  camera.unproject(pixels, bearings, is_valid);
  std::size_t num_visible = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!projection.is_visible[i]) continue;
    ++num_visible;
    EXPECT_TRUE(camera.contains(pixels[i])) << "point " << points[i].transpose();
    EXPECT_TRUE(is_valid[i]) << "point " << points[i].transpose();
    EXPECT_LT(bearings[i].cross(points[i].normalized()).norm(), options.angle_tolerance_rad)
        << "point " << points[i].transpose();
    EXPECT_GT(bearings[i].dot(points[i]), 0.0) << "point " << points[i].transpose();
  }
  EXPECT_GT(num_visible, 50u);
}

/// The Jacobian agrees with central differences, and moving along the ray moves nothing.
inline void expect_jacobian_is_derivative(const Camera& camera, const CameraTestOptions& options) {
  const std::vector<Eigen::Vector3d> points = random_points_for_test(4000, 2);
  const CameraTestProjection projection = project_for_test(camera, points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!projection.is_visible[i]) continue;
    const Matrix23d& jacobian = projection.jacobians[i];
    const double largest = jacobian.cwiseAbs().maxCoeff();
    const double step = 1e-6 * points[i].norm();
    std::vector<Eigen::Vector3d> moved;
    for (int axis = 0; axis < 3; ++axis) {
      moved.push_back(points[i] + step * Eigen::Vector3d::Unit(axis));
      moved.push_back(points[i] - step * Eigen::Vector3d::Unit(axis));
    }
    const CameraTestProjection around = project_for_test(camera, moved);
    if (std::count(around.is_visible.begin(), around.is_visible.end(), 0) > 0) continue;
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector2d change = around.pixels[2 * axis] - around.pixels[2 * axis + 1];
      if (const double wrap = camera.wrap_width_px(); wrap > 0.0) {
        change.x() -= wrap * std::round(change.x() / wrap);
      }
      const Eigen::Vector2d numeric = change / (2.0 * step);
      EXPECT_LT((jacobian.col(axis) - numeric).norm(), options.jacobian_tolerance * largest)
          << "point " << points[i].transpose() << ", axis " << axis;
    }
    EXPECT_LT((jacobian * points[i]).norm(), 1e-9 * largest * points[i].norm())
        << "point " << points[i].transpose();
  }
}

/// Points and pixels without an image or bearing are reported as such, whatever they are.
inline void expect_outside_is_refused(const Camera& camera) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const CameraTestProjection projection = project_for_test(
      camera,
      {{nan, 0.0, 1.0}, {0.0, nan, 1.0}, {0.0, 0.0, nan}, {nan, nan, nan}, {infinity, nan, 1.0}});
  for (std::size_t i = 0; i < projection.is_visible.size(); ++i) {
    EXPECT_FALSE(projection.is_visible[i]) << "NaN point " << i;
  }
  // Every visible point has a pixel within the image, however extreme the direction.
  std::vector<Eigen::Vector3d> extremes;
  for (const double x : {-1e300, -1e9, -1.0, 0.0, 1e-300, 1.0, 1e9}) {
    for (const double y : {-1e9, -1e-300, 0.0, 1.0, 1e300}) {
      for (const double z : {-1e9, -1.0, -1e-300, 0.0, 1e-300, 1e-9, 1.0, 1e300}) {
        if (x != 0.0 || y != 0.0 || z != 0.0) extremes.emplace_back(x, y, z);
      }
    }
  }
  const CameraTestProjection extreme = project_for_test(camera, extremes);
  for (std::size_t i = 0; i < extremes.size(); ++i) {
    if (!extreme.is_visible[i]) continue;
    EXPECT_TRUE(camera.contains(extreme.pixels[i])) << "point " << extremes[i].transpose();
  }
  const std::vector<Eigen::Vector2d> pixels = {{nan, 0.0}, {0.0, nan}, {-1e7, 3e7}, {1e9, -1e9}};
  std::vector<Eigen::Vector3d> bearings(pixels.size());
  std::vector<std::uint8_t> is_valid(pixels.size());
  camera.unproject(pixels, bearings, is_valid);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!is_valid[i]) continue;
    EXPECT_NEAR(bearings[i].norm(), 1.0, 1e-12) << "pixel " << i;
  }
}

/// A call for an array gives, bit for bit, what calls for its elements give, and so does project
/// beside project_with_jacobian.
inline void expect_batch_equals_scalar(const Camera& camera) {
  const std::vector<Eigen::Vector3d> points = random_points_for_test(1000, 3);
  const CameraTestProjection batch = project_for_test(camera, points);
  std::vector<Eigen::Vector2d> plain(points.size());
  std::vector<std::uint8_t> plain_is_visible(points.size());
  camera.project(points, plain, plain_is_visible);
  EXPECT_EQ(plain_is_visible, batch.is_visible);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const CameraTestProjection one = project_for_test(camera, {points[i]});
    ASSERT_EQ(one.is_visible[0], batch.is_visible[i]);
    if (!batch.is_visible[i]) continue;
    EXPECT_EQ(one.pixels[0], batch.pixels[i]);
    EXPECT_EQ(one.jacobians[0], batch.jacobians[i]);
    EXPECT_EQ(plain[i], batch.pixels[i]);
    Eigen::Vector3d alone;
    std::uint8_t is_alone_valid = 0;
    camera.unproject({&batch.pixels[i], 1}, {&alone, 1}, {&is_alone_valid, 1});
    std::vector<Eigen::Vector2d> twice(2, batch.pixels[i]);
    std::vector<Eigen::Vector3d> bearings(2);
    std::vector<std::uint8_t> is_valid(2);
    camera.unproject(twice, bearings, is_valid);
    EXPECT_EQ(is_valid[1], is_alone_valid);
    if (is_alone_valid) {
      EXPECT_EQ(bearings[1], alone);
    }
  }
}

/// The test that every camera model passes, in the library or outside of it. Call it for several
/// cameras, the widest that the model allows among them.
inline void expect_camera_is_sound(const Camera& camera, const CameraTestOptions& options = {}) {
  EXPECT_FALSE(camera.model().empty());
  EXPECT_GT(camera.width_px(), 0);
  EXPECT_GT(camera.height_px(), 0);
  expect_pixels_survive(camera, options);
  expect_directions_survive(camera, options);
  expect_jacobian_is_derivative(camera, options);
  expect_outside_is_refused(camera);
  expect_batch_equals_scalar(camera);
}

}  // namespace waymark

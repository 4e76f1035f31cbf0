// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/calibrate/lens.h"

#include <gtest/gtest.h>

#include <cmath>

#include "waymark/geometry/bearing.h"

namespace waymark {
namespace {

/// Angle off the axis at which a pixel on the horizontal through the centre is seen.
double angle_at(const CameraDescription& lens, double radius_px) {
  const auto camera = make_if_possible(lens);
  const std::vector<Eigen::Vector2d> pixel = {{lens.intrinsics[2] + radius_px, lens.intrinsics[3]}};
  std::vector<Eigen::Vector3d> bearing(1);
  std::vector<std::uint8_t> is_valid(1);
  camera->unproject(pixel, bearing, is_valid);
  return is_valid[0] ? angle_between(bearing[0], Eigen::Vector3d::UnitZ()) : -1.0;
}

TEST(Lens, HasTheFieldOfViewItIsMadeFor) {
  for (const LensModel model : {LensModel::kPerspective, LensModel::kFisheye}) {
    const double focal_px = focal_length_of(model, 80.0 * kRadiansPerDegree, 640);
    const auto camera = make_if_possible(make_lens(model, focal_px, 640, 480));
    EXPECT_NEAR(horizontal_fov_rad(*camera), 80.0 * kRadiansPerDegree, 1e-9) << to_string(model);
  }
  const auto sphere = make_if_possible(make_lens(LensModel::kEquirectangular, 0.0, 640, 320));
  EXPECT_NEAR(horizontal_fov_rad(*sphere), 360.0 * kRadiansPerDegree, 1e-9);
}

TEST(Lens, TakesOverTheCurveOfTheDivisionModel) {
  const CameraDescription size = make_lens(LensModel::kPerspective, 1.0, 640, 480);
  for (const auto& [model, focal_px, division] : {std::tuple{LensModel::kPerspective, 400.0, -0.25},
                                                  std::tuple{LensModel::kPerspective, 500.0, 0.05},
                                                  std::tuple{LensModel::kFisheye, 200.0, -0.35}}) {
    const CameraDescription lens = with_coefficients(model, focal_px, division, size);
    for (const double radius_px : {50.0, 150.0, 250.0, 310.0}) {
      const double radius = radius_px / focal_px;
      const double angle = std::atan2(radius, 1.0 + division * radius * radius);
      EXPECT_NEAR(angle_at(lens, radius_px), angle, 0.02) << to_string(model) << " " << radius_px;
    }
  }
}

TEST(Lens, ChangesByItsNumbers) {
  const CameraDescription lens = make_lens(LensModel::kPerspective, 500.0, 640, 480);
  LensChange change;
  change << std::log(1.1), 0.01, 3.0, -2.0, -0.1, 0.02;
  const CameraDescription to = changed(lens, change)->description;
  EXPECT_NEAR(to.intrinsics[0], 550.0, 1e-9);
  EXPECT_NEAR(to.intrinsics[1], 550.0 * std::exp(0.01), 1e-9);
  EXPECT_EQ(to.intrinsics[2], 322.5);
  EXPECT_EQ(to.intrinsics[3], 237.5);
  EXPECT_EQ(to.distortion_coeffs, (std::vector<double>{-0.1, 0.02, 0.0, 0.0}));
  change[4] = -5.0;  // Folds nearly all of the image back.
  EXPECT_FALSE(changed(lens, change));
}

TEST(Lens, GrowsWithItsImages) {
  const CameraDescription lens = make_lens(LensModel::kPerspective, 500.0, 640, 480);
  const CameraDescription large = enlarged(lens, 2.0, 1280, 960);
  EXPECT_EQ(large.intrinsics, (std::vector<double>{1000.0, 1000.0, 639.5, 479.5}));
  EXPECT_NEAR(angle_at(large, 200.0), angle_at(lens, 100.0), 1e-12);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
// Every camera model: the shared test at usual and at extreme parameters, equality with another
// model or with OpenCV where two agree, and the limits of the field of view.
#include <gmock/gmock.h>

#include <numbers>
#include <opencv2/calib3d.hpp>

#include "waymark/camera/division.h"
#include "waymark/camera/equirectangular.h"
#include "waymark/camera/fisheye.h"
#include "waymark/camera/perspective.h"
#include "waymark/camera/testing/camera_test.h"
#include "waymark/camera/unified.h"

namespace waymark {
namespace {

constexpr int kSizePx = 512;
constexpr double kPi = std::numbers::pi;

ImagePlane plane(double focal_px) { return {{focal_px, 1.01 * focal_px}, {254.9, 256.8}}; }

template <class Model>
void expect_model_is_sound(const Model& model, double min_valid_part = 0.5) {
  CameraTestOptions options;
  options.min_valid_part = min_valid_part;
  expect_camera_is_sound(ModelCamera<Model>(model, kSizePx, kSizePx), options);
}

/// Both project alike, wherever both see a point.
template <class A, class B>
void expect_same_projection(const A& a, const B& b, double tolerance_px = 1e-9) {
  int num_seen = 0;
  for (const Eigen::Vector3d& point : random_points_for_test(2000, 3)) {
    const auto pixel_a = a.project(point);
    const auto pixel_b = b.project(point);
    if (!pixel_a || !pixel_b || pixel_a->norm() > 1e4) continue;
    ++num_seen;
    EXPECT_LT((*pixel_a - *pixel_b).norm(), tolerance_px) << point.transpose();
  }
  EXPECT_GT(num_seen, 500);
}

/// The largest angle off the axis at which a point along x is seen.
template <class Model>
double seen_angle(const Model& model) {
  double low = 0.0, high = kPi;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (model.project({std::sin(middle), 0.0, std::cos(middle)}) ? low : high) = middle;
  }
  return low;
}

// Of the TUM-VI data set, whose lens covers 195 degrees.
const std::array<double, 4> kTumVi = {0.0034823894, 0.0007150348, -0.0020532361, 0.00020293673};

TEST(Fisheye, IsSound) {
  expect_model_is_sound(FisheyeModel(plane(191.0), kTumVi));
  expect_model_is_sound(FisheyeModel(plane(140.0), {0.0, 0.0, 0.0, 0.0}));
  // 200 degrees in a circle inside the image.
  expect_model_is_sound(FisheyeModel(plane(130.0), {0.05, -0.01, -0.012, 0.002}), 0.3);
  // Ends where the polynomial folds, inside the image.
  expect_model_is_sound(FisheyeModel(plane(200.0), {-0.08, 0.0, 0.0, 0.0}), 0.3);
}

TEST(Fisheye, ProjectsAsOpenCv) {
  const FisheyeModel model(plane(191.0), kTumVi);
  std::vector<cv::Point3d> points;
  std::vector<Eigen::Vector2d> ours;
  for (const Eigen::Vector3d& point : random_points_for_test(2000, 4)) {
    if (point.z() < 0.05 * point.norm()) continue;
    points.emplace_back(point.x(), point.y(), point.z());
    ours.push_back(model.project(point).value());
  }
  const ImagePlane p = plane(191.0);
  const cv::Matx33d matrix(
      p.focal_px.x(), 0.0, p.center_px.x(), 0.0, p.focal_px.y(), p.center_px.y(), 0.0, 0.0, 1.0);
  std::vector<cv::Point2d> theirs;
  cv::fisheye::projectPoints(points,
                             theirs,
                             cv::Vec3d(),
                             cv::Vec3d(),
                             matrix,
                             cv::Vec4d(kTumVi[0], kTumVi[1], kTumVi[2], kTumVi[3]));
  for (std::size_t i = 0; i < ours.size(); ++i) {
    EXPECT_LT((ours[i] - Eigen::Vector2d(theirs[i].x, theirs[i].y)).norm(), 1e-9);
  }
}

TEST(Fisheye, EndsWhereThePolynomialFolds) {
  const FisheyeModel folding(plane(200.0), {-0.1, 0.0, 0.0, 0.0});
  const double end = std::sqrt(0.95 / 0.3);  // 1 - 0.3 t^2 = 0.05
  EXPECT_NEAR(folding.max_angle_rad(), end, 1e-12);
  EXPECT_NEAR(seen_angle(folding), end, 1e-9);
  const double end_px = 200.0 * (end - 0.1 * end * end * end);
  const Eigen::Vector2d center = folding.plane().center_px;
  EXPECT_TRUE(folding.unproject(center + Eigen::Vector2d(end_px - 0.01, 0.0)));
  EXPECT_FALSE(folding.unproject(center + Eigen::Vector2d(end_px + 0.01, 0.0)));
}

TEST(Fisheye, SeesBehindItself) {
  const FisheyeModel model(plane(80.0), {0.0, 0.0, 0.0, 0.0});
  EXPECT_EQ(model.max_angle_rad(), kPi);
  const double angle = 3.0;
  const auto pixel = model.project(5.0 * Eigen::Vector3d(0.0, std::sin(angle), std::cos(angle)));
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->y(), 256.8 + 80.8 * angle, 1e-9);
  EXPECT_NEAR(model.unproject(*pixel)->z(), std::cos(angle), 1e-12);
  EXPECT_FALSE(model.project({0.0, 0.0, -1.0}));  // Has no one pixel.
}

TEST(Equirectangular, IsSound) {
  CameraTestOptions options;
  options.min_valid_part = 1.0;
  for (const auto& [width, height] : {std::pair(1280, 640), std::pair(641, 320)}) {
    const EquirectangularCamera camera(EquirectangularModel(width, height), width, height);
    expect_camera_is_sound(camera, options);
    EXPECT_EQ(camera.wrap_width_px(), width);
  }
}

TEST(Equirectangular, LaysOutDirectionsAsDocumented) {
  const EquirectangularModel model(1280, 640);
  EXPECT_EQ(model.project({0.0, 0.0, 3.0}), Eigen::Vector2d(639.5, 319.5));
  EXPECT_EQ(model.project({2.0, 0.0, 0.0}), Eigen::Vector2d(959.5, 319.5));
  EXPECT_EQ(model.project({-2.0, 0.0, 0.0}), Eigen::Vector2d(319.5, 319.5));
  EXPECT_EQ(model.project({0.0, 0.0, -1.0}), Eigen::Vector2d(-0.5, 319.5));
  EXPECT_EQ(model.project({-0.0, 0.0, -1.0}), Eigen::Vector2d(-0.5, 319.5));
  EXPECT_EQ(model.project({0.0, 1.0, 1.0}), Eigen::Vector2d(639.5, 479.5));
  EXPECT_FALSE(model.project({0.0, 1.0, 0.0}));
  EXPECT_FALSE(model.unproject({639.5, -0.6}));
  // Columns repeat.
  const Eigen::Vector3d left = model.unproject({-100.0, 200.0}).value();
  EXPECT_LT((left - model.unproject({1180.0, 200.0}).value()).norm(), 1e-12);
}

TEST(Unified, IsSound) {
  const std::vector<double> coeffs = {-0.12, 0.03, 1e-3, -5e-4};
  for (const double xi : {0.0, 0.4, 0.97, 1.0, 1.6, 3.0}) {
    SCOPED_TRACE(xi);
    expect_model_is_sound(UnifiedModel(xi, plane(150.0 * (1.0 + xi))));
    expect_model_is_sound(UnifiedModel(xi, plane(250.0 * (1.0 + xi)), coeffs), 0.4);
  }
}

TEST(Unified, WithoutMirrorIsPerspective) {
  const std::vector<double> coeffs = {-0.12, 0.03, 1e-3, -5e-4};
  const ImagePlane p = plane(300.0);
  expect_same_projection(UnifiedModel(0.0, p), PerspectiveModel(p.focal_px, p.center_px));
  const UnifiedModel distorted(0.0, p, coeffs);
  const PerspectiveModel perspective(p.focal_px, p.center_px, coeffs);
  int num_seen = 0;
  for (const Eigen::Vector3d& point : random_points_for_test(2000, 3)) {
    const auto a = distorted.project(point), b = perspective.project(point);
    ASSERT_EQ(a.has_value(), b.has_value());
    if (!a) continue;
    ++num_seen;
    EXPECT_LT((*a - *b).norm(), 1e-9);
  }
  EXPECT_GT(num_seen, 500);
}

TEST(Unified, EndsWhereItFolds) {
  // A paraboloid (xi = 1) covers all but straight back; a weaker mirror up to cos = -xi.
  EXPECT_GT(UnifiedModel(1.0, plane(200.0)).max_angle_rad(), 3.14);
  EXPECT_NEAR(UnifiedModel(0.5, plane(200.0)).max_angle_rad(), std::acos(-0.5), 1e-6);
  // Beyond, x stops growing at cos = -1 / xi.
  const double end = UnifiedModel(2.0, plane(200.0)).max_angle_rad();
  EXPECT_LT(end, std::acos(-0.5));
  EXPECT_GT(end, std::acos(-0.5) - 0.15);
  EXPECT_NEAR(seen_angle(UnifiedModel(2.0, plane(200.0))), end, 1e-9);
}

TEST(ExtendedUnified, IsSound) {
  for (const double alpha : {0.0, 0.3, 0.5, 0.64, 0.8, 1.0}) {
    for (const double beta : {0.6, 1.0, 1.4}) {
      SCOPED_TRACE(::testing::Message() << alpha << " " << beta);
      expect_model_is_sound(ExtendedUnifiedModel(alpha, beta, plane(190.0)), 0.3);
    }
  }
}

TEST(ExtendedUnified, GeneralisesTheUnifiedCamera) {
  // alpha = xi / (1 + xi), beta = 1, focal length by 1 + xi (Usenko et al. 2018, section II B).
  const double xi = 1.3;
  expect_same_projection(ExtendedUnifiedModel(xi / (1.0 + xi), 1.0, plane(200.0)),
                         UnifiedModel(xi, plane(200.0 * (1.0 + xi))));
}

TEST(DoubleSphere, IsSound) {
  for (const double xi : {-0.3, 0.0, 0.2, 0.8}) {
    for (const double alpha : {0.0, 0.4, 0.57, 0.8, 1.0}) {
      SCOPED_TRACE(::testing::Message() << xi << " " << alpha);
      expect_model_is_sound(DoubleSphereModel(xi, alpha, plane(170.0)), 0.3);
    }
  }
}

TEST(DoubleSphere, WithOneSphereIsUnified) {
  expect_same_projection(DoubleSphereModel(0.0, 0.6, plane(200.0)),
                         ExtendedUnifiedModel(0.6, 1.0, plane(200.0)));
  // alpha = 0: only the first sphere is left.
  expect_same_projection(DoubleSphereModel(0.7, 0.0, plane(200.0)),
                         UnifiedModel(0.7, plane(200.0)));
}

TEST(Division, IsSound) {
  for (const double k : {-1.5, -0.4, -0.05, 0.0, 0.05, 0.4}) {
    SCOPED_TRACE(k);
    expect_model_is_sound(DivisionModel(plane(250.0), k), 0.4);
  }
}

TEST(Division, DirectionFollowsTheDefinition) {
  const DivisionModel model(plane(200.0), -0.5);
  const Eigen::Vector2d offset(0.9, -0.6);
  const Eigen::Vector3d direction(0.9, -0.6, 1.0 - 0.5 * offset.squaredNorm());
  const auto bearing = model.unproject(model.plane().to_pixel(offset));
  EXPECT_LT((bearing.value() - direction.normalized()).norm(), 1e-12);
  // Past 1 / sqrt(-k) the camera looks back.
  const Eigen::Vector2d far_offset(2.0, 0.5);
  EXPECT_LT(model.unproject(model.plane().to_pixel(far_offset))->z(), 0.0);
  const DivisionModel pincushion(plane(200.0), 0.25);
  EXPECT_NEAR(seen_angle(pincushion), pincushion.max_angle_rad(), 1e-9);
  EXPECT_LT(pincushion.max_angle_rad(), 0.25 * kPi);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/stereo.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "waymark/base/check.h"
#include "waymark/base/median.h"
#include "waymark/camera/model_camera.h"
#include "waymark/camera/perspective.h"
#include "waymark/features/frame_builder.h"
#include "waymark/features/testing/plane_scene.h"
#include "waymark/geometry/rigid3.h"

namespace waymark {
namespace {

using testing::PlaneScene;
using testing::TexturedPlane;

constexpr int kWidth = 480;
constexpr int kHeight = 320;

std::shared_ptr<const Camera> perspective(double focal_px, std::vector<double> distortion) {
  return std::make_shared<PerspectiveCamera>(
      PerspectiveModel({focal_px, focal_px + 2.0}, {0.5 * kWidth, 0.5 * kHeight + 3.0}, distortion),
      kWidth,
      kHeight);
}

/// Equidistant: the image radius is proportional to the angle, so that straight lines are curves.
struct EquidistantModel {
  static constexpr std::string_view kName = "test_equidistant";
  double focal_px;

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p) const {
    const double radius = p.head<2>().norm();
    const double angle = std::atan2(radius, p.z());
    if (angle > 0.55 * std::numbers::pi) return std::nullopt;
    const double scale = radius > 1e-12 ? focal_px * angle / radius : focal_px / p.z();
    return Eigen::Vector2d(0.5 * kWidth, 0.5 * kHeight) + scale * p.head<2>();
  }
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d offset =
        (pixel - Eigen::Vector2d(0.5 * kWidth, 0.5 * kHeight)) / focal_px;
    const double angle = offset.norm();
    if (angle > 0.55 * std::numbers::pi) return std::nullopt;
    const Eigen::Vector2d side = angle > 1e-12 ? Eigen::Vector2d(offset / angle) : offset;
    return Eigen::Vector3d(std::sin(angle) * side.x(), std::sin(angle) * side.y(), std::cos(angle));
  }
  Matrix23d jacobian(const Eigen::Vector3d& p) const {
    Matrix23d result;
    const double step = 1e-6 * p.norm();
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d delta = step * Eigen::Vector3d::Unit(axis);
      result.col(axis) = (*project(p + delta) - *project(p - delta)) / (2.0 * step);
    }
    return result;
  }
};

std::shared_ptr<const Camera> equidistant(double focal_px) {
  return std::make_shared<ModelCamera<EquidistantModel>>(
      EquidistantModel{focal_px}, kWidth, kHeight);
}

/// Camera 1 is 0.1 m to the right of camera 0, turned by a rotation vector in degrees.
Rig make_rig(std::shared_ptr<const Camera> camera0,
             std::shared_ptr<const Camera> camera1,
             const Eigen::Vector3d& turned_deg) {
  const Eigen::Quaterniond rotation = so3_exp(turned_deg * std::numbers::pi / 180.0);
  const Eigen::Vector3d origin(0.1, 0.004, -0.003);
  return {{{std::move(camera0), Rigid3()},
           {std::move(camera1), Rigid3(rotation, -(rotation * origin))}}};
}

/// A slanted wall, with a board in front of it.
PlaneScene make_scene() {
  const Eigen::Vector3d slanted = Eigen::Vector3d(1.0, 0.0, 0.5).normalized();
  return PlaneScene(
      {{{0.0, 0.0, 3.0}, slanted, Eigen::Vector3d::UnitY(), 8.0, 0.05},
       {{0.35, 0.1, 1.2}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), 0.25, 0.02}});
}

struct Statistics {
  std::size_t num_visible = 0;      ///< Features whose point is seen by camera 1, with some margin.
  std::size_t num_right = 0;        ///< Of those, matched to less than a pixel of the level.
  std::size_t num_wrong = 0;        ///< Of all matches.
  double median_error_px = 0.0;     ///< In pixels of the level.
  double median_bias_px = 0.0;      ///< Of the error along the curve, towards near.
  double median_range_error = 0.0;  ///< Relative.
};

struct Truth {
  bool is_visible;
  Eigen::Vector2d pixel;
  double range_m;
};

Truth truth_of(const PlaneScene& scene, const Rig& rig, const Eigen::Vector3d& bearing) {
  const double range = scene.range(Eigen::Vector3d::Zero(), bearing).value_or(100.0);
  const Rigid3& cam1_from_cam0 = rig.cameras[1].cam_from_rig;
  const std::vector<Eigen::Vector3d> point = {cam1_from_cam0 * (range * bearing)};
  std::vector<Eigen::Vector2d> pixel(1);
  std::vector<std::uint8_t> is_visible(1);
  rig.cameras[1].camera->project(point, pixel, is_visible);
  const Eigen::Vector3d origin = cam1_from_cam0.origin_in_source();
  const Eigen::Vector3d back = range * bearing - origin;
  const std::optional<double> seen = scene.range(origin, back.normalized());
  constexpr double kMarginPx = 40.0;
  const bool is_inside = is_visible[0] && pixel[0].minCoeff() > kMarginPx &&
                         pixel[0].x() < kWidth - kMarginPx && pixel[0].y() < kHeight - kMarginPx;
  return {is_inside && seen && std::abs(*seen - back.norm()) < 1e-6, pixel[0], range};
}

/// told: what the search is told of the rig.
Statistics match(const Rig& rig, const Rig& told) {
  const PlaneScene scene = make_scene();
  const Image image0 = scene.render(*rig.cameras[0].camera, rig.cameras[0].cam_from_rig);
  const Image image1 = scene.render(*rig.cameras[1].camera, rig.cameras[1].cam_from_rig);
  FrameBuilder builder(told, {.features = {.count = 400}});
  const std::shared_ptr<const Features> features =
      builder.build({.image0 = image0.view(), .image1 = image1.view()});
  Statistics statistics;
  std::vector<double> errors;
  std::vector<double> biases;
  std::vector<double> range_errors;
  for (std::size_t i = 0; i < features->num_primary; ++i) {
    const Truth truth = truth_of(scene, rig, features->bearings[i].cast<double>().normalized());
    statistics.num_visible += truth.is_visible;
    if (features->partner[i] == kNoFeature) continue;
    const Keypoint& found = features->keypoints[features->partner[i]];
    const Eigen::Vector2d error =
        (Eigen::Vector2d(found.x_px, found.y_px) - truth.pixel) / Pyramid::scale(found.level);
    if (!(error.norm() < 1.0)) {
      ++statistics.num_wrong;
      continue;
    }
    statistics.num_right += truth.is_visible;
    errors.push_back(error.norm());
    biases.push_back(error.x());
    range_errors.push_back(std::abs(features->range_m[i] / truth.range_m - 1.0));
  }
  statistics.median_error_px = median(errors);
  statistics.median_bias_px = median(biases);
  statistics.median_range_error = median(range_errors);
  return statistics;
}

void expect_good(const Rig& rig) {
  const Statistics statistics = match(rig, rig);
  EXPECT_GT(statistics.num_visible, 150u);
  EXPECT_GT(statistics.num_right, 0.8 * statistics.num_visible);
  EXPECT_LT(statistics.num_wrong, 0.05 * statistics.num_right);
  EXPECT_LT(statistics.median_error_px, 0.05);
  EXPECT_LT(std::abs(statistics.median_bias_px), 0.02);
  EXPECT_LT(statistics.median_range_error, 0.012);
}

TEST(Stereo, FindsFeaturesInAParallelPair) {
  expect_good(make_rig(perspective(380.0, {}), perspective(380.0, {}), {0.0, 0.0, 0.0}));
}

TEST(Stereo, FindsFeaturesInDistortedImagesOfTurnedCameras) {
  expect_good(make_rig(perspective(380.0, {-0.28, 0.07, 2e-4, 1e-4}),
                       perspective(360.0, {-0.25, 0.06, -1e-4, 2e-4}),
                       {2.0, -3.0, 6.0}));
}

TEST(Stereo, FindsFeaturesAtAnotherScale) {
  expect_good(make_rig(perspective(420.0, {}), perspective(300.0, {}), {0.0, 0.0, 20.0}));
}

TEST(Stereo, FindsFeaturesAlongCurves) {
  expect_good(make_rig(equidistant(180.0), equidistant(180.0), {1.0, 4.0, 0.0}));
}

TEST(Stereo, FindsFeaturesOfAPerspectiveImageInAFisheyeImage) {
  expect_good(
      make_rig(perspective(300.0, {-0.1, 0.01, 0.0, 0.0}), equidistant(250.0), {0.0, 0.0, 0.0}));
}

TEST(Stereo, SeesWhatIsBesideTheCurve) {
  constexpr double kFocalPx = 380.0;
  constexpr double kHalfPixelDeg = 0.5 / kFocalPx * 180.0 / std::numbers::pi;
  const auto camera = perspective(kFocalPx, {});
  const Statistics statistics = match(make_rig(camera, camera, {kHalfPixelDeg, 0.0, 0.0}),
                                      make_rig(camera, camera, {0.0, 0.0, 0.0}));
  EXPECT_GT(statistics.num_right, 0.7 * statistics.num_visible);
  EXPECT_LT(statistics.median_error_px, 0.1);
  EXPECT_LT(std::abs(statistics.median_bias_px), 0.02);
}

TEST(Stereo, RefusesRigsThatAreNoPair) {
  const auto camera = perspective(380.0, {});
  EXPECT_THROW(StereoSearch({{{camera, Rigid3()}}}, {}), InputError);
  EXPECT_THROW(StereoSearch({{{camera, Rigid3()}, {camera, Rigid3()}}}, {}), InputError);
}

}  // namespace
}  // namespace waymark

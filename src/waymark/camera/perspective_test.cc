// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/perspective.h"

#include <gmock/gmock.h>

#include <opencv2/calib3d.hpp>

#include "waymark/camera/testing/camera_test.h"

namespace waymark {
namespace {

struct PerspectiveCase {
  const char* name;
  Eigen::Vector2d focal_px;
  Eigen::Vector2d center_px;
  std::vector<double> coeffs;
  int width_px;
  int height_px;

  PerspectiveModel model() const { return PerspectiveModel(focal_px, center_px, coeffs); }
  PerspectiveCamera camera() const { return PerspectiveCamera(model(), width_px, height_px); }
  cv::Matx33d matrix() const {
    return {focal_px.x(), 0.0, center_px.x(), 0.0, focal_px.y(), center_px.y(), 0.0, 0.0, 1.0};
  }
};

// Calibrations of the EuRoC, KITTI and TUM RGB-D data sets, and a wide-angle one of eight
// coefficients.
const std::vector<PerspectiveCase>& test_cameras() {
  static const std::vector<PerspectiveCase> cameras = {
      {"euroc",
       {458.654, 457.296},
       {367.215, 248.375},
       {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05},
       752,
       480},
      {"kitti", {718.856, 718.856}, {607.1928, 185.2157}, {}, 1241, 376},
      {"tum_fr1",
       {517.306408, 516.469215},
       {318.643040, 255.313989},
       {0.262383, -0.953104, -0.005358, 0.002628, 1.163314},
       640,
       480},
      {"wide",
       {300.0, 305.0},
       {320.0, 235.0},
       {0.9, 0.12, 2e-4, -3e-4, 2e-3, 1.25, 0.31, 0.012},
       640,
       480},
  };
  return cameras;
}

std::vector<Eigen::Vector3d> bearings_of(const Camera& camera,
                                         const std::vector<Eigen::Vector2d>& pixels) {
  std::vector<Eigen::Vector3d> bearings(pixels.size());
  std::vector<std::uint8_t> is_valid(pixels.size());
  camera.unproject(pixels, bearings, is_valid);
  EXPECT_EQ(std::count(is_valid.begin(), is_valid.end(), 0), 0);
  return bearings;
}

TEST(Perspective, IsSound) {
  for (const PerspectiveCase& test : test_cameras()) {
    SCOPED_TRACE(test.name);
    CameraTestOptions options;
    options.min_valid_part = 1.0;
    options.pixel_tolerance_px = 1e-9;
    expect_camera_is_sound(test.camera(), options);
  }
}

TEST(Perspective, ProjectsAsOpenCv) {
  for (const PerspectiveCase& test : test_cameras()) {
    SCOPED_TRACE(test.name);
    const std::vector<Eigen::Vector3d> points = random_points_for_test(5000, 7);
    const CameraTestProjection ours = project_for_test(test.camera(), points);
    std::vector<cv::Point3d> cv_points;
    for (const Eigen::Vector3d& point : points)
      cv_points.emplace_back(point.x(), point.y(), point.z());
    std::vector<cv::Point2d> theirs;
    cv::projectPoints(cv_points, cv::Vec3d(), cv::Vec3d(), test.matrix(), test.coeffs, theirs);
    int num_compared = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!ours.is_visible[i]) continue;
      EXPECT_NEAR(ours.pixels[i].x(), theirs[i].x, 1e-9);
      EXPECT_NEAR(ours.pixels[i].y(), theirs[i].y, 1e-9);
      ++num_compared;
    }
    EXPECT_GT(num_compared, 200);
  }
}

TEST(Perspective, UnprojectsAsOpenCv) {
  for (const PerspectiveCase& test : test_cameras()) {
    SCOPED_TRACE(test.name);
    const PerspectiveCamera camera = test.camera();
    const std::vector<Eigen::Vector2d> pixels = pixel_grid_for_test(camera, 21);
    std::vector<cv::Point2d> cv_pixels, theirs;
    for (const Eigen::Vector2d& pixel : pixels) cv_pixels.emplace_back(pixel.x(), pixel.y());
    cv::undistortPoints(cv_pixels,
                        theirs,
                        test.matrix(),
                        test.coeffs,
                        cv::noArray(),
                        cv::noArray(),
                        cv::TermCriteria(cv::TermCriteria::COUNT, 2000, 0.0));
    const std::vector<Eigen::Vector3d> ours = bearings_of(camera, pixels);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      EXPECT_NEAR(ours[i].x() / ours[i].z(), theirs[i].x, 1e-9) << pixels[i].transpose();
      EXPECT_NEAR(ours[i].y() / ours[i].z(), theirs[i].y, 1e-9) << pixels[i].transpose();
    }
  }
}

TEST(Perspective, PointsBehindAreInvisible) {
  const PerspectiveCamera camera = test_cameras()[0].camera();
  const CameraTestProjection projection = project_for_test(
      camera, {{0.1, 0.1, 2.0}, {-0.1, -0.1, -2.0}, {0.0, 0.0, -1.0}, {0.1, 0.0, 0.0}});
  EXPECT_THAT(projection.is_visible, ::testing::ElementsAre(1, 0, 0, 0));
}

// x - 0.3 x^3 grows up to x = 1 / sqrt(0.9) = 1.054; beyond, the image folds back.
TEST(Perspective, FieldOfViewEndsBeforeTheFold) {
  const std::vector<double> coeffs = {-0.3, 0.0, 0.0, 0.0};
  const PerspectiveModel model({400.0, 400.0}, {500.0, 500.0}, coeffs);
  const double end = std::sqrt(model.max_radius_squared());
  EXPECT_LT(end, 1.0541);
  EXPECT_GT(end, 1.02);
  EXPECT_TRUE(model.project({0.999 * end, 0.0, 1.0}));
  EXPECT_FALSE(model.project({1.001 * end, 0.0, 1.0}));
  EXPECT_FALSE(model.project({3.0, 0.0, 1.0}));
  EXPECT_NEAR(model.max_distorted_radius(), end - 0.3 * end * end * end, 1e-9);
  const double end_px = 400.0 * model.max_distorted_radius();
  EXPECT_TRUE(model.unproject({500.0 + 0.9999 * end_px, 500.0}));
  EXPECT_FALSE(model.unproject({500.0 + 1.02 * end_px, 500.0}));
  EXPECT_FALSE(model.unproject({500.0, 5000.0}));
}

TEST(Perspective, PoleOfTheRationalModelEndsTheFieldOfView) {
  const std::vector<double> coeffs = {0.0, 0.0, 0.0, 0.0, 0.0, -0.5, 0.0, 0.0};
  const PerspectiveModel model({400.0, 400.0}, {500.0, 500.0}, coeffs);
  EXPECT_NEAR(model.max_radius_squared(), 2.0, 1e-9);
  EXPECT_FALSE(model.project({2.0, 0.0, 1.0}));
  const auto bearing = model.unproject({1000.0, 700.0});
  ASSERT_TRUE(bearing);
  EXPECT_LT((*model.project(*bearing) - Eigen::Vector2d(1000.0, 700.0)).norm(), 1e-8);
}

TEST(Perspective, MonotoneDistortionEndsAt80Degrees) {
  const double radius = std::sqrt(test_cameras()[0].model().max_radius_squared());
  EXPECT_NEAR(std::atan(radius), 80.0 * std::numbers::pi / 180.0, 1e-3);
  EXPECT_TRUE(std::isinf(test_cameras()[1].model().max_radius_squared()));
}

// Whatever the coefficients, a bearing that comes back projects to its pixel.
TEST(Perspective, RandomCoefficientsNeverGiveAWrongBearing) {
  Rng rng(5, 0);
  int num_valid = 0;
  for (int round = 0; round < 300; ++round) {
    std::vector<double> coeffs(8);
    for (double& coeff : coeffs) coeff = rng.uniform(-1.0, 1.0);
    coeffs[2] *= 0.02;
    coeffs[3] *= 0.02;
    const PerspectiveModel model({300.0, 300.0}, {320.0, 240.0}, coeffs);
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector2d pixel(rng.uniform(0.0, 640.0), rng.uniform(0.0, 480.0));
      const auto bearing = model.unproject(pixel);
      if (!bearing) continue;
      ++num_valid;
      const auto back = model.project(*bearing);
      ASSERT_TRUE(back);
      EXPECT_LT((*back - pixel).norm(), 1e-8);
    }
  }
  EXPECT_GT(num_valid, 5000);
}

TEST(Perspective, WrongNumberOfCoefficientsIsRefused) {
  const std::vector<double> three = {0.1, 0.2, 0.3};
  EXPECT_THROW(PerspectiveModel({1.0, 1.0}, {0.0, 0.0}, three), CheckError);
}

}  // namespace
}  // namespace waymark

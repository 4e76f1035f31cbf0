// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/marker/detect.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/camera/registry.h"
#include "waymark/marker/square_pose.h"
#include "waymark/marker/testing/draw.h"

namespace waymark {
namespace {

using testing::draw_marker;
using testing::look_at_marker;
constexpr double kRadPerDegree = std::numbers::pi / 180.0;
constexpr double kSide = 0.2;

std::shared_ptr<const Camera> make_camera(const std::string& model) {
  CameraDescription description;
  description.width_px = 220;
  description.height_px = 160;
  description.camera_model = model == "fisheye" ? "pinhole" : model;
  description.intrinsics = {200.0, 200.0, 110.0, 80.0};
  if (model == "fisheye") {
    description.distortion_model = "equidistant";
    description.distortion_coeffs = {0.02, -0.01, 0.003, -0.001};
    description.intrinsics = {80.0, 80.0, 110.0, 80.0};
  }
  if (model == "equirectangular") {
    description.intrinsics = {};
    description.width_px = 400;
    description.height_px = 200;
  }
  return CameraRegistry::with_builtin_models().make_camera(description);
}

void blur(Image& image, double sigma) {
  cv::Mat mat(image.height_px, image.width_px, CV_8UC1, image.values.data());
  if (sigma > 0.0) cv::GaussianBlur(mat, mat, cv::Size(), sigma);
}

/// Root mean square distance of the corners from the truth, in px; negative: not found.
double corner_error_px(const MarkerDetector& detector,
                       const Camera& camera,
                       const Image& image,
                       int id,
                       const Rigid3& cam_from_marker) {
  for (const MarkerObservation& observation : detector.detect(image.view(), camera, 0)) {
    EXPECT_EQ(observation.id, id);
    if (observation.id == id)
      return std::sqrt(squared_error_px(observation, cam_from_marker, kSide));
  }
  return -1.0;
}

/// An image as cameras take them: blurred, with noise of 2 grey values.
Image photograph(const Camera& camera,
                 const MarkerFamily& family,
                 int id,
                 const Rigid3& cam_from_marker,
                 double blur_px) {
  Image image = draw_marker(camera, family, id, cam_from_marker, kSide, 0.0);
  blur(image, blur_px);
  Rng rng(5, static_cast<std::uint64_t>(id));
  for (std::uint8_t& grey : image.values) {
    const long noisy = std::lround(grey + 2.0 * rng.normal());
    grey = static_cast<std::uint8_t>(std::clamp(noisy, 0L, 255L));
  }
  return image;
}

struct View {
  const char* model;
  const char* family;
  double focal_px;
  double side_px;
  double tilt_deg;
  double blur_px;
  double limit_px;
};

class DetectView : public ::testing::TestWithParam<View> {};

TEST_P(DetectView, FindsCornersToAFractionOfAPixel) {
  const View& view = GetParam();
  const auto camera = make_camera(view.model);
  const MarkerDetector detector{MarkerFamily(view.family)};
  for (const int id : {3, 11}) {
    const Eigen::Vector3d aside(0.02 * id - 0.15, 0.12 - 0.01 * id, 1.0);
    const Rigid3 pose = look_at_marker(
        aside, view.focal_px * kSide / view.side_px, view.tilt_deg * kRadPerDegree, 0.4 * id);
    const Image image = photograph(*camera, detector.family(), id, pose, view.blur_px);
    const double error = corner_error_px(detector, *camera, image, id, pose);
    EXPECT_GE(error, 0.0) << "not found";
    EXPECT_LT(error, view.limit_px);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Views,
    DetectView,
    ::testing::Values(View{"pinhole", "tag36h11", 200, 60, 15, 0.0, 0.1},
                      View{"pinhole", "tag36h11", 200, 60, 60, 0.7, 0.15},
                      View{"pinhole", "tag36h11", 200, 30, 45, 0.5, 0.2},
                      View{"pinhole", "tag36h11", 200, 22, 15, 0.0, 0.25},
                      View{"pinhole", "aruco_4x4_50", 200, 15, 15, 0.0, 0.3},
                      View{"pinhole", "aruco_4x4_50", 200, 60, 75, 0.0, 0.4},
                      View{"fisheye", "tag36h11", 80, 50, 30, 0.5, 0.2},
                      View{"equirectangular", "tag36h11", 63.7, 40, 30, 0.5, 0.25}));

/// Where a marker is thought to be: a pixel aside, a hundredth too far, turned by two degrees.
Rigid3 about(const Rigid3& pose, double focal_px) {
  const Rigid3 off(Eigen::Quaterniond(Eigen::AngleAxisd(0.035, Eigen::Vector3d(1, 2, 2) / 3.0)),
                   Eigen::Vector3d::Zero());
  Rigid3 guess = pose * off;
  guess.translation *= 1.01;
  guess.translation += pose.translation.norm() / focal_px * Eigen::Vector3d(0.7, -0.7, 0.0);
  return guess;
}

class ConfirmView : public ::testing::TestWithParam<View> {};

TEST_P(ConfirmView, FindsWhatIsTooSmallOrTooSlantingToBeRead) {
  const View& view = GetParam();
  const auto camera = make_camera(view.model);
  const MarkerDetector detector{MarkerFamily(view.family)};
  for (const int id : {3, 11}) {
    const Eigen::Vector3d aside(0.02 * id - 0.15, 0.12 - 0.01 * id, 1.0);
    const Rigid3 pose = look_at_marker(
        aside, view.focal_px * kSide / view.side_px, view.tilt_deg * kRadPerDegree, 0.4 * id);
    const Image image = photograph(*camera, detector.family(), id, pose, view.blur_px);
    const std::vector<ExpectedMarker> expected = {{id, kSide, about(pose, view.focal_px)}};
    const MarkerObservations found = detector.confirm(image.view(), *camera, 1, expected);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].id, id);
    EXPECT_EQ(found[0].camera, 1);
    EXPECT_LT(std::sqrt(squared_error_px(found[0], pose, kSide)), view.limit_px);
  }
}

INSTANTIATE_TEST_SUITE_P(Views,
                         ConfirmView,
                         ::testing::Values(View{"pinhole", "tag36h11", 200, 8, 15, 0.0, 0.15},
                                           View{"pinhole", "tag36h11", 200, 8, 45, 1.0, 0.3},
                                           View{"pinhole", "tag36h11", 200, 12, 60, 1.0, 0.3},
                                           View{"pinhole", "tag36h11", 200, 20, 75, 1.0, 0.3},
                                           View{"pinhole", "tag36h11", 200, 60, 75, 1.0, 0.3},
                                           View{"pinhole", "aruco_4x4_50", 200, 6, 15, 0.0, 0.2},
                                           View{"fisheye", "tag36h11", 80, 10, 30, 0.5, 0.3}));

TEST(ConfirmTest, NothingIsConfirmedWhereThereIsNoneOrAnother) {
  const auto camera = make_camera("pinhole");
  const MarkerDetector detector{MarkerFamily("tag36h11")};
  const Rigid3 pose = look_at_marker({0.1, 0.0, 1.0}, 200 * kSide / 10, 0.5, 0.2);
  const Image image = photograph(*camera, detector.family(), 4, pose, 0.7);
  const auto confirm = [&](int id, const Rigid3& at) {
    const std::vector<ExpectedMarker> expected = {{id, kSide, at}};
    return detector.confirm(image.view(), *camera, 0, expected).size();
  };
  EXPECT_EQ(confirm(4, pose), 1u);
  for (const int id : {5, 100, 586}) EXPECT_EQ(confirm(id, pose), 0u) << id;
  // Beside it, before a plain wall; behind the camera; and seen from behind.
  EXPECT_EQ(confirm(4, look_at_marker({-0.3, 0.2, 1.0}, 200 * kSide / 10, 0.5, 0.2)), 0u);
  EXPECT_EQ(confirm(4, Rigid3(pose.rotation, -pose.translation)), 0u);
  const Eigen::Quaterniond around(Eigen::AngleAxisd(EIGEN_PI, Eigen::Vector3d::UnitY()));
  EXPECT_EQ(confirm(4, Rigid3(pose.rotation * around, pose.translation)), 0u);
  EXPECT_EQ(confirm(100000, pose), 0u);
  Image noise(camera->width_px(), camera->height_px());
  Rng rng(1, 2);
  for (std::uint8_t& grey : noise.values) grey = static_cast<std::uint8_t>(rng.below(256));
  const std::vector<ExpectedMarker> expected = {{4, kSide, pose}};
  EXPECT_TRUE(detector.confirm(noise.view(), *camera, 0, expected).empty());
}

TEST(DetectTest, TooSmallAMarkerIsMissedAndNeverTakenForAnother) {
  const auto camera = make_camera("pinhole");
  const MarkerDetector detector{MarkerFamily("tag36h11")};
  for (const double side_px : {5.0, 8.0, 12.0}) {
    const Rigid3 pose = look_at_marker({0.1, 0.0, 1.0}, 200 * kSide / side_px, 0.5, 0.2);
    const Image image = photograph(*camera, detector.family(), 4, pose, 0.7);
    corner_error_px(detector, *camera, image, 4, pose);  // Expects that number.
  }
}

TEST(DetectTest, NothingIsFoundInNoiseOrInAnEmptyImage) {
  const auto camera = make_camera("pinhole");
  const MarkerDetector detector{MarkerFamily("tag36h11")};
  Image image(camera->width_px(), camera->height_px());
  EXPECT_TRUE(detector.detect(image.view(), *camera, 0).empty());
  Rng rng(1, 2);
  for (std::uint8_t& grey : image.values) grey = static_cast<std::uint8_t>(rng.below(256));
  EXPECT_TRUE(detector.detect(image.view(), *camera, 0).empty());
}

TEST(FamilyTest, ModulesAreABlackBorderAroundBits) {
  const MarkerFamily family("tag36h11");
  EXPECT_EQ(family.size(), 587);
  EXPECT_EQ(family.side_modules(), 8);
  const std::vector<std::uint8_t> modules = family.modules(0);
  ASSERT_EQ(modules.size(), 64u);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_FALSE(modules[i] || modules[56 + i] || modules[8 * i] || modules[8 * i + 7]);
  }
  EXPECT_NE(modules, family.modules(1));
}

TEST(FamilyTest, AnUnknownNameIsAnErrorThatListsWhatThereIs) {
  try {
    MarkerFamily family("tag99");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("'tag99' is unknown, expected one of tag16h5"));
  }
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/tangent.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>
#include <numbers>

namespace waymark {
namespace {

/// A pinhole and a 360 degree image are the two extremes: straight lines and poles.
class TestCamera : public Camera {
 public:
  using Camera::Camera;

  virtual Eigen::Vector2d pixel_of(const Eigen::Vector3d& point) const = 0;
  virtual Eigen::Vector3d bearing_of(const Eigen::Vector2d& pixel) const = 0;
  virtual bool sees(const Eigen::Vector3d& point) const = 0;

  std::string_view model() const override { return "test"; }

  void project(std::span<const Eigen::Vector3d> points,
               std::span<Eigen::Vector2d> pixels,
               std::span<std::uint8_t> is_visible) const override {
    for (std::size_t i = 0; i < points.size(); ++i) {
      pixels[i] = pixel_of(points[i]);
      is_visible[i] = sees(points[i]) && contains(pixels[i]);
    }
  }

  void project_with_jacobian(std::span<const Eigen::Vector3d> points,
                             std::span<Eigen::Vector2d> pixels,
                             std::span<Matrix23d> jacobians,
                             std::span<std::uint8_t> is_visible) const override {
    project(points, pixels, is_visible);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double step = 1e-6 * points[i].norm();
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d delta = step * Eigen::Vector3d::Unit(axis);
        jacobians[i].col(axis) =
            (pixel_of(points[i] + delta) - pixel_of(points[i] - delta)) / (2.0 * step);
      }
    }
  }

  void unproject(std::span<const Eigen::Vector2d> pixels,
                 std::span<Eigen::Vector3d> bearings,
                 std::span<std::uint8_t> is_valid) const override {
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      bearings[i] = bearing_of(pixels[i]);
      is_valid[i] = std::isfinite(bearings[i].x());
    }
  }
};

class Pinhole : public TestCamera {
 public:
  Pinhole() : TestCamera(640, 480) {}
  Eigen::Vector2d pixel_of(const Eigen::Vector3d& p) const override {
    return {400.0 * p.x() / p.z() + 320.0, 300.0 * p.y() / p.z() + 240.0};
  }
  /// Without a bearing left of column 10.
  Eigen::Vector3d bearing_of(const Eigen::Vector2d& pixel) const override {
    if (pixel.x() < 10.0) return Eigen::Vector3d::Constant(NAN);
    return Eigen::Vector3d((pixel.x() - 320.0) / 400.0, (pixel.y() - 240.0) / 300.0, 1.0)
        .normalized();
  }
  bool sees(const Eigen::Vector3d& point) const override { return point.z() > 0.0; }
};

class Panorama : public TestCamera {
 public:
  Panorama() : TestCamera(1280, 640) {}
  Eigen::Vector2d pixel_of(const Eigen::Vector3d& p) const override {
    const double per_rad = 640.0 / std::numbers::pi;
    return {639.5 + per_rad * std::atan2(p.x(), p.z()),
            319.5 + per_rad * std::atan2(p.y(), std::hypot(p.x(), p.z()))};
  }
  Eigen::Vector3d bearing_of(const Eigen::Vector2d& pixel) const override {
    const double per_rad = 640.0 / std::numbers::pi;
    const double longitude = (pixel.x() - 639.5) / per_rad;
    const double latitude = (pixel.y() - 319.5) / per_rad;
    return {std::cos(latitude) * std::sin(longitude),
            std::sin(latitude),
            std::cos(latitude) * std::cos(longitude)};
  }
  bool sees(const Eigen::Vector3d&) const override { return true; }
  double wrap_width_px() const override { return 1280.0; }
};

TEST(Tangent, ResidualIsReprojectionErrorInPixelsOfTheLevel) {
  const Pinhole camera;
  const std::vector<Eigen::Vector2d> pixels = {{320.0, 240.0}, {600.5, 17.25}, {50.0, 470.0}};
  const std::vector<float> scales = {1.0f, 1.44f, 2.0f};
  TangentComputer computer;
  const TangentArrays& arrays = computer.compute(camera, pixels, scales);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    ASSERT_TRUE(arrays.is_valid[i]);
    EXPECT_NEAR(arrays.bearings[i].norm(), 1.0f, 1e-6f);
    const Eigen::Vector2d moved(0.8, -0.6);
    const Eigen::Vector3d predicted = camera.bearing_of(pixels[i] + moved);
    const Eigen::Vector2d residual = arrays.level_pixel_from_bearing[i].cast<double>() *
                                     (predicted - arrays.bearings[i].cast<double>());
    EXPECT_LT((residual - moved / scales[i]).norm(), 0.01);
    const Eigen::Vector2f along = arrays.level_pixel_from_bearing[i] * arrays.bearings[i];
    EXPECT_LT(along.norm(), 1e-3f);
  }
}

TEST(Tangent, MatchesNumericDerivative) {
  const Panorama camera;
  const std::vector<Eigen::Vector2d> pixels = {{1100.0, 500.0}};
  const std::vector<float> scales = {1.2f};
  TangentComputer computer;
  const TangentArrays& arrays = computer.compute(camera, pixels, scales);
  const Eigen::Vector3d bearing = camera.bearing_of(pixels[0]);
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Vector3d tangent = Eigen::Vector3d::Unit(axis);
    tangent -= bearing * bearing.dot(tangent);
    const Eigen::Vector2d numeric =
        (camera.pixel_of(bearing + 1e-5 * tangent) - camera.pixel_of(bearing - 1e-5 * tangent)) /
        (2e-5 * 1.2);
    const Eigen::Vector2d column = arrays.level_pixel_from_bearing[0].col(axis).cast<double>();
    EXPECT_LT((column - numeric).norm(), 0.02);
  }
}

TEST(Tangent, SizeIsTheGeometricMeanOfBothDirections) {
  const Pinhole camera;
  const std::vector<Eigen::Vector2d> pixels = {{320.0, 240.0}};
  const std::vector<float> scales = {2.0f};
  TangentComputer computer;
  EXPECT_NEAR(
      computer.compute(camera, pixels, scales).size_rad[0], 2.0 / std::sqrt(400.0 * 300.0), 1e-7);
}

TEST(Tangent, IsBoundedNearThePoleAndLowersOnlyTheSteepDirection) {
  const Panorama camera;
  const std::vector<Eigen::Vector2d> pixels = {{100.0, 2.0}, {900.0, 60.0}, {639.5, 250.0}};
  const std::vector<float> scales = {1.0f, 1.0f, 1.0f};
  TangentComputer computer;
  const TangentArrays& arrays = computer.compute(camera, pixels, scales);
  const float per_rad = static_cast<float>(640.0 / std::numbers::pi);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    ASSERT_TRUE(arrays.is_valid[i]);
    const auto values =
        Eigen::JacobiSVD<Matrix23f>(arrays.level_pixel_from_bearing[i]).singularValues();
    EXPECT_NEAR(values[1], per_rad, 0.01f * per_rad);
    const double latitude = std::abs(pixels[i].y() - 319.5) / per_rad;
    const double stretch = std::min(TangentComputer::kMaxStretch, 1.0 / std::cos(latitude));
    EXPECT_NEAR(values[0] / values[1], stretch, 0.01);
    EXPECT_NEAR(arrays.size_rad[i] * std::sqrt(values[0] * values[1]), 1.0f, 1e-3f);
  }
}

TEST(Tangent, TellsWhatIsStretched) {
  Matrix23d w = Matrix23d::Zero();
  w(0, 0) = 500.0;
  for (const double smaller : {500.0, 170.0, 160.0, 0.0}) {
    w(1, 1) = smaller;
    const Eigen::Matrix2d turn = Eigen::Rotation2Dd(0.4).toRotationMatrix();
    EXPECT_EQ(TangentComputer::is_stretched(turn * w),
              smaller * TangentComputer::kMaxStretch < 500.0);
  }
  w(0, 0) = std::nan("");
  EXPECT_TRUE(TangentComputer::is_stretched(w));
}

TEST(Tangent, PixelsWithoutBearingAreInvalidAndLeaveTheOthersAlone) {
  const Pinhole camera;
  const std::vector<Eigen::Vector2d> pixels = {{5.0, 5.0}, {320.0, 100.0}};
  const std::vector<float> scales = {1.0f, 1.0f};
  TangentComputer computer;
  const TangentArrays& arrays = computer.compute(camera, pixels, scales);
  EXPECT_FALSE(arrays.is_valid[0]);
  EXPECT_TRUE(arrays.is_valid[1]);
}

}  // namespace
}  // namespace waymark

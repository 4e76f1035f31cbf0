// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/depth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "waymark/base/testing/allocation_count.h"

namespace waymark {
namespace {

constexpr double kDepthFocalPx = 500.0;
constexpr double kFactor = 5000.0;

struct Measured {
  float range_m;
  float sigma;
};

DepthImage depth_image(const std::function<double(int x, int y)>& depth_m) {
  DepthImage image(64, 48);
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = 0; x < image.width_px; ++x) {
      image.row(y)[x] = static_cast<std::uint16_t>(std::lround(kFactor * depth_m(x, y)));
    }
  }
  return image;
}

/// Of the pixel of a pinhole camera by the bearing, tangential.
Matrix23f derivative(const Eigen::Vector3f& bearing) {
  const float z = std::max(bearing.z(), 1e-3f);
  Matrix23f result;
  result << 1.0f / z, 0.0f, -bearing.x() / (z * z), 0.0f, 1.0f / z, -bearing.y() / (z * z);
  return static_cast<float>(kDepthFocalPx) *
         (result - (result * bearing).eval() * bearing.transpose()).eval();
}

Measured measure(const DepthImage& image, float x_px, float y_px, Eigen::Vector3f bearing) {
  const std::vector<Keypoint> keypoints = {{.x_px = x_px, .y_px = y_px}};
  const std::vector<Eigen::Vector3f> bearings = {bearing.normalized()};
  const std::vector<Matrix23f> derivatives = {derivative(bearings[0])};
  FeatureArray<float> range_m;
  FeatureArray<float> sigma;
  sample_depth(
      image.view(), {.factor = kFactor}, keypoints, bearings, derivatives, 0, range_m, sigma);
  return {range_m[0], sigma[0]};
}

Measured measure(const DepthImage& image, float x_px, float y_px) {
  return measure(image, x_px, y_px, {0.0f, 0.0f, 1.0f});
}

TEST(Depth, IsConvertedFromAlongZToAlongTheBearing) {
  const DepthImage image = depth_image([](int, int) { return 2.0; });
  const Measured on_axis = measure(image, 30.0f, 20.0f);
  EXPECT_NEAR(on_axis.range_m, 2.0f, 1e-4f);
  EXPECT_NEAR(on_axis.sigma, 1.43e-3f, 1e-5f);
  const Measured oblique = measure(image, 30.0f, 20.0f, {0.6f, 0.0f, 0.8f});
  EXPECT_NEAR(oblique.range_m, 2.5f, 1e-4f);
  EXPECT_NEAR(oblique.sigma, 0.8f * 1.43e-3f, 3e-5f);
}

TEST(Depth, CornerOnAnEdgeBelongsToTheNearerSurface) {
  const DepthImage image = depth_image([](int x, int) { return x < 32 ? 1.5 : 4.0; });
  for (const float x_px : {30.0f, 31.4f, 32.0f, 33.0f}) {
    EXPECT_NEAR(measure(image, x_px, 20.0f).range_m, 1.5f, 0.01f) << x_px;
  }
  EXPECT_NEAR(measure(image, 36.0f, 20.0f).range_m, 4.0f, 0.01f);
}

TEST(Depth, StrayNearPixelIsNoSurface) {
  const DepthImage image = depth_image([](int x, int y) { return x == 31 && y == 20 ? 0.6 : 3.0; });
  EXPECT_NEAR(measure(image, 30.0f, 20.0f).range_m, 3.0f, 1e-3f);
}

TEST(Depth, SlantedSurfaceIsOneSurfaceAndLessCertain) {
  // A wall that turns away at 70 degrees: inverse depth is linear in x.
  const auto depth_m = [](double x) {
    return 1.0 / (0.5 * (1.0 + std::tan(1.22) * (x - 30.0) / kDepthFocalPx));
  };
  const DepthImage image = depth_image([&](int x, int) { return depth_m(x); });
  const Measured slanted = measure(image, 30.5f, 20.0f);
  EXPECT_NEAR(slanted.range_m, depth_m(30.5), 3e-3);
  EXPECT_GT(slanted.sigma, 1.4 * 1.43e-3);
  EXPECT_LT(slanted.sigma, 3.0 * 1.43e-3);
}

TEST(Depth, NoMeasurementIsZero) {
  const DepthImage image = depth_image([](int x, int) { return x < 32 ? 0.0 : 2.0; });
  EXPECT_EQ(measure(image, 20.0f, 20.0f).range_m, 0.0f);
  EXPECT_EQ(measure(image, 20.0f, 20.0f).sigma, 0.0f);
  // A hole beside a surface: the surface in reach is taken.
  EXPECT_NEAR(measure(image, 31.0f, 20.0f).range_m, 2.0f, 1e-3f);
  // Sideways or backwards there is no depth along z.
  EXPECT_EQ(measure(image, 40.0f, 20.0f, {1.0f, 0.0f, 0.0f}).range_m, 0.0f);
}

TEST(Depth, KeypointsAtTheBorderAreSafe) {
  const DepthImage image = depth_image([](int, int) { return 2.0; });
  for (const float x_px : {-0.4f, 0.0f, 63.4f}) {
    for (const float y_px : {-0.4f, 47.4f}) {
      EXPECT_NEAR(measure(image, x_px, y_px).range_m, 2.0f, 1e-3f);
    }
  }
}

TEST(Depth, AllocatesNothingOnceWarm) {
  const DepthImage slanted = depth_image([](int x, int y) { return 1.0 + 0.01 * x + 0.02 * y; });
  const std::vector<Keypoint> keypoints(50, {.x_px = 20.3f, .y_px = 17.8f});
  const std::vector<Eigen::Vector3f> bearings(50, Eigen::Vector3f::UnitZ());
  const std::vector<Matrix23f> derivatives(50, derivative(bearings[0]));
  FeatureArray<float> range_m;
  FeatureArray<float> sigma;
  sample_depth(
      slanted.view(), {.factor = kFactor}, keypoints, bearings, derivatives, 0, range_m, sigma);
  const long before = testing::num_allocations();
  sample_depth(
      slanted.view(), {.factor = kFactor}, keypoints, bearings, derivatives, 0, range_m, sigma);
  EXPECT_EQ(testing::num_allocations() - before, 0);
  EXPECT_GT(range_m[49], 1.0f);
}

}  // namespace
}  // namespace waymark

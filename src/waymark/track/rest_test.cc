// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/rest.h"

#include <gtest/gtest.h>

#include <vector>

#include "waymark/camera/equirectangular.h"
#include "waymark/camera/perspective.h"

namespace waymark {
namespace {

constexpr int kWidthPx = 600, kHeightPx = 300;
constexpr float kPixelRad = 0.005f;

/// Matches all over an image, those right of a column moved by some pixels.
bool is_at_rest_with_moved(const Camera& camera, float from_x_px, float moved_px) {
  Features before, now;
  std::vector<FeatureMatch> matches;
  for (int y = 10; y < kHeightPx; y += 20) {
    for (int x = 10; x < kWidthPx; x += 20) {
      const auto index = static_cast<std::uint32_t>(matches.size());
      const float shift_px = static_cast<float>(x) >= from_x_px ? moved_px : 0.3f;
      Keypoint keypoint;
      keypoint.x_px = static_cast<float>(x) + shift_px;
      keypoint.y_px = static_cast<float>(y);
      before.bearings.push_back(Eigen::Vector3f::UnitZ());
      now.bearings.push_back({kPixelRad * shift_px, 0.0f, 1.0f});
      now.keypoints.push_back(keypoint);
      before.size_rad.push_back(kPixelRad);
      now.size_rad.push_back(kPixelRad);
      matches.push_back({index, index, 0});
    }
  }
  return is_at_rest(camera, before, now, matches);
}

TEST(Rest, IsWhereMostOfTheImageStays) {
  const PerspectiveCamera camera(
      PerspectiveModel({200.0, 200.0}, {300.0, 150.0}), kWidthPx, kHeightPx);
  EXPECT_TRUE(is_at_rest_with_moved(camera, kWidthPx, 20.0f)) << "nothing moves";
  EXPECT_TRUE(is_at_rest_with_moved(camera, 400.0f, 20.0f)) << "a thing before it does";
  EXPECT_FALSE(is_at_rest_with_moved(camera, 200.0f, 20.0f));
  EXPECT_FALSE(is_at_rest_with_moved(camera, 0.0f, 3.0f)) << "the camera moves, slowly";
}

TEST(Rest, IsMoreOfASphereWhichShowsWhatCarriesTheCamera) {
  const EquirectangularCamera camera(
      EquirectangularModel(kWidthPx, kHeightPx), kWidthPx, kHeightPx);
  EXPECT_TRUE(is_at_rest_with_moved(camera, 500.0f, 20.0f));
  EXPECT_FALSE(is_at_rest_with_moved(camera, 400.0f, 20.0f));
}

TEST(Rest, NeedsMatches) {
  const PerspectiveCamera camera(
      PerspectiveModel({200.0, 200.0}, {300.0, 150.0}), kWidthPx, kHeightPx);
  EXPECT_FALSE(is_at_rest(camera, {}, {}, {}));
}

}  // namespace
}  // namespace waymark

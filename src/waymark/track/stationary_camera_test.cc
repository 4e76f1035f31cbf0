// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/stationary_camera.h"

#include <gtest/gtest.h>

#include <functional>
#include <vector>

#include "waymark/camera/equirectangular.h"
#include "waymark/camera/perspective.h"

namespace waymark {
namespace {

constexpr int kWidthPx = 600, kHeightPx = 300;
constexpr float kPixelRad = 0.005f;

/// By where a feature is: how far it moved.
using Motion = std::function<float(float x_px, float y_px)>;

/// With matches all over an image.
bool update(StationaryCamera& rest, const Camera& camera, const Motion& moved_px) {
  Features before, now;
  std::vector<FeatureMatch> matches;
  for (int y = 10; y < kHeightPx; y += 20) {
    for (int x = 10; x < kWidthPx; x += 20) {
      const auto index = static_cast<std::uint32_t>(matches.size());
      const float shift_px = moved_px(static_cast<float>(x), static_cast<float>(y));
      Keypoint keypoint;
      keypoint.x_px = static_cast<float>(x) + shift_px;
      keypoint.y_px = static_cast<float>(y);
      before.bearings.push_back(Eigen::Vector3f::UnitZ());
      now.bearings.push_back({kPixelRad * shift_px, 0.0f, 1.0f});
      now.keypoints.push_back(keypoint);
      matches.push_back({index, index, 0});
    }
  }
  rest.update(camera, before, now, matches);
  return rest.is_at_rest();
}

bool is_at_rest_in(const Camera& camera, const Motion& moved_px) {
  StationaryCamera rest;
  return update(rest, camera, moved_px);
}

bool is_at_rest_with_moved(const Camera& camera, float from_x_px, float moved_px) {
  return is_at_rest_in(camera, [&](float x, float) { return x >= from_x_px ? moved_px : 0.1f; });
}

PerspectiveCamera perspective() {
  return PerspectiveCamera(PerspectiveModel({200.0, 200.0}, {300.0, 150.0}), kWidthPx, kHeightPx);
}

TEST(StationaryCamera, IsWhereTheImageStays) {
  const PerspectiveCamera camera = perspective();
  EXPECT_TRUE(is_at_rest_with_moved(camera, kWidthPx, 20.0f)) << "nothing moves";
  EXPECT_TRUE(is_at_rest_with_moved(camera, 400.0f, 20.0f)) << "a thing before it does";
  EXPECT_FALSE(is_at_rest_with_moved(camera, 200.0f, 20.0f));
  EXPECT_FALSE(is_at_rest_with_moved(camera, 0.0f, 3.0f)) << "the camera moves, slowly";
}

TEST(StationaryCamera, IsSeenAroundWhatHidesHalfOfTheView) {
  const auto box = [](float x, float y) {
    return x > 100.0f && x < 500.0f && y > 80.0f ? 20.0f : 0.1f;
  };
  EXPECT_TRUE(is_at_rest_in(perspective(), box));
}

TEST(StationaryCamera, IsNotWhatStaysBeforeAMovingCamera) {
  const PerspectiveCamera camera = perspective();
  const auto beyond = [](float, float y) { return y < 200.0f ? 0.8f : 20.0f; };
  EXPECT_FALSE(is_at_rest_in(camera, beyond)) << "far away, with a turn of a pixel";
  const auto text = [](float, float y) { return y < 40.0f || y > 260.0f ? 0.0f : 20.0f; };
  EXPECT_FALSE(is_at_rest_in(camera, text)) << "burnt-in lines above and below";
  const auto bonnet = [](float, float y) { return y > 150.0f ? 0.0f : 20.0f; };
  EXPECT_FALSE(is_at_rest_in(camera, bonnet));
}

TEST(StationaryCamera, IsMoreOfASphereWhichShowsWhatCarriesTheCamera) {
  const EquirectangularCamera camera(
      EquirectangularModel(kWidthPx, kHeightPx), kWidthPx, kHeightPx);
  EXPECT_TRUE(is_at_rest_with_moved(camera, 500.0f, 20.0f));
  EXPECT_FALSE(is_at_rest_with_moved(camera, 400.0f, 20.0f));
}

TEST(StationaryCamera, GoesOnBehindWhatComesNearer) {
  const PerspectiveCamera camera = perspective();
  const auto until = [](float x_px) {
    return [x_px](float x, float) { return x < x_px ? 0.1f : 20.0f; };
  };
  StationaryCamera rest;
  EXPECT_FALSE(update(rest, camera, until(100.0f))) << "not by itself";
  EXPECT_TRUE(update(rest, camera, until(400.0f)));
  EXPECT_TRUE(update(rest, camera, until(200.0f)));
  EXPECT_TRUE(update(rest, camera, until(100.0f)));
}

TEST(StationaryCamera, EndsWhenTheCameraMovesThoughTextStays) {
  const PerspectiveCamera camera = perspective();
  const auto text = [](float, float y) { return y < 75.0f ? 0.0f : 5.0f; };
  StationaryCamera rest;
  EXPECT_TRUE(update(rest, camera, [](float, float) { return 0.1f; }));
  EXPECT_FALSE(update(rest, camera, text));
}

TEST(StationaryCamera, NeedsMatches) {
  StationaryCamera rest;
  rest.update(perspective(), {}, {}, {});
  EXPECT_FALSE(rest.is_at_rest());
}

}  // namespace
}  // namespace waymark

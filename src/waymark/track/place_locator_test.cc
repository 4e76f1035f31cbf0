// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/place_locator.h"

#include <gtest/gtest.h>

#include <utility>

#include "waymark/camera/fisheye.h"
#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

double error_m(const Rigid3& rig_from_world, const Rigid3& truth) {
  return (rig_from_world.origin_in_source() - truth.translation).norm();
}

/// A perspective camera's map of a cloud from three keyframes side by side.
class PlaceLocatorTest : public ::testing::TestWithParam<int> {
 protected:
  PlaceLocatorTest() : scene_(GetParam(), cloud_ahead(), {.seed = 5}, true), locator_(1) {
    for (const double x : {0.0, 0.5, 1.0}) scene_.add_keyframe(pose_at(x));
  }

  std::optional<LocatedPlace> locate(const PointObservation& view) {
    return locator_.locate(*view.features, scene_.map, KeyframeId{0}, 7);
  }

  /// Part of the associations that are true.
  double share_of_true(const PointObservation& view, const LocatedPlace& place) const {
    const std::vector<LandmarkId>& landmarks = place.frame.landmarks;
    const std::vector<LandmarkId> truth = scene_.true_associations(view);
    int num_set = 0;
    int num_true = 0;
    for (std::size_t i = 0; i < view.features->num_primary; ++i) {
      num_set += landmarks[i].is_valid();
      num_true += landmarks[i].is_valid() && landmarks[i] == truth[i];
    }
    return double(num_true) / num_set;
  }

  TestMap scene_;
  PlaceLocator locator_;
};

TEST_P(PlaceLocatorTest, FindsThePoseOfAFarView) {
  const Rigid3 truth = make_test_pose({1.5, -0.4, 1.2}, {0.1, -0.2, 0.3});
  const PointObservation view = scene_.look(truth, 100);
  const auto place = locate(view);
  ASSERT_TRUE(place);
  EXPECT_LT(error_m(place->frame.rig_from_world, truth), 0.02);
  EXPECT_GT(place->frame.num_inliers, 200);
  EXPECT_GT(place->confidence, 0.5);
  EXPECT_GT(share_of_true(view, *place), 0.98);
  EXPECT_TRUE(place->reference.is_valid());
}

TEST_P(PlaceLocatorTest, FindsThePoseNearAGuess) {
  const Rigid3 truth = make_test_pose({1.5, -0.4, 1.2}, {0.1, -0.2, 0.3});
  const Rigid3 guess =
      Rigid3::exp((Vector6d() << 0.1, -0.1, 0.1, 0.03, 0.03, 0.0).finished()) * truth.inverse();
  const PointObservation view = scene_.look(truth, 100);
  const auto place = locator_.locate_near(*view.features, scene_.map, KeyframeId{0}, guess);
  ASSERT_TRUE(place);
  EXPECT_LT(error_m(place->frame.rig_from_world, truth), 0.02);
  EXPECT_GT(place->frame.num_inliers, 200);
  EXPECT_GT(share_of_true(view, *place), 0.98);
}

TEST_P(PlaceLocatorTest, RefusesAnotherPlaceNearAGuess) {
  scene_.cloud = scatter_in({-5.0, -3.0, 4.0}, {5.0, 3.0, 9.0}, 1500, 6.0, 99);
  const Rigid3 pose = pose_at(0.3);
  EXPECT_FALSE(locator_.locate_near(
      *scene_.look(pose, 100).features, scene_.map, KeyframeId{0}, pose.inverse()));
}

TEST_P(PlaceLocatorTest, GivesTheSameBitsAgain) {
  const PointObservation view = scene_.look(pose_at(0.8, 0.3, 0.5, 0.1), 100);
  const auto first = locate(view);
  const auto second = locate(view);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->frame.rig_from_world.matrix(), second->frame.rig_from_world.matrix());
  EXPECT_EQ(first->frame.landmarks, second->frame.landmarks);
}

TEST_P(PlaceLocatorTest, RefusesAnotherPlace) {
  scene_.cloud = scatter_in({-5.0, -3.0, 4.0}, {5.0, 3.0, 9.0}, 1500, 6.0, 99);
  EXPECT_FALSE(locate(scene_.look(pose_at(0.3), 100)));
}

TEST_P(PlaceLocatorTest, RefusesAnObjectThatMoved) {
  // What one corner shows of the place hangs elsewhere now; it agrees with itself, all else is new.
  PointCloud moved = scatter_in({-5.0, -3.0, 4.0}, {5.0, 3.0, 9.0}, 1500, 6.0, 99);
  for (std::size_t i = 0; i < moved.landmarks.size(); ++i) {
    const PointLandmark& point = scene_.cloud.landmarks[i];
    if (point.position.x() < 2.0 || point.position.y() < 1.0) continue;
    moved.landmarks[i] = point;
    moved.landmarks[i].position -= Eigen::Vector3d(2.0, 2.0, 0.0);
  }
  scene_.cloud = std::move(moved);
  EXPECT_FALSE(locate(scene_.look(pose_at(0.3), 100)));
}

TEST_P(PlaceLocatorTest, RefusesTheSameLooksInAnotherOrder) {
  auto& points = scene_.cloud.landmarks;
  for (std::size_t i = 0; i + 1 < points.size(); i += 2) {
    std::swap(points[i].descriptor, points[i + 1].descriptor);
  }
  EXPECT_FALSE(locate(scene_.look(pose_at(0.3), 100)));
}

INSTANTIATE_TEST_SUITE_P(Cameras, PlaceLocatorTest, ::testing::Values(1, 2), [](const auto& info) {
  return info.param == 1 ? "mono" : "stereo";
});

TEST(PlaceLocator, FindsAViewOfAnotherCamera) {
  TestMap scene(1, cloud_ahead(), {.seed = 5}, false);
  for (const double x : {0.0, 0.5, 1.0}) scene.add_keyframe(pose_at(x));
  // Some 200 degrees on 512 x 512 pixels: half as fine as the camera of the map.
  const FisheyeModel model({{150.0, 150.0}, {255.5, 255.5}}, {0.01, -0.01, 0.003, 0.0});
  Rig fisheye;
  fisheye.cameras.push_back({std::make_shared<FisheyeCamera>(model, 512, 512), Rigid3()});
  const auto rig = std::make_shared<const Rig>(std::move(fisheye));
  const Rigid3 truth = pose_at(0.4, 0.2, 0.8, 0.2);
  const PointObservation view = observe(scene.cloud, rig, truth, scene.noise, 100);
  PlaceLocator locator(1);
  const auto place = locator.locate(*view.features, scene.map, KeyframeId{0}, 7);
  ASSERT_TRUE(place);
  EXPECT_LT(error_m(place->frame.rig_from_world, truth), 0.04);
  EXPECT_GT(place->frame.num_inliers, 100);
}

}  // namespace
}  // namespace waymark

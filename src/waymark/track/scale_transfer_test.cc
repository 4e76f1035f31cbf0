// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/scale_transfer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

/// A camera that goes sideways before a cloud, is lost, and begins a new part further on.
class ScaleKeeperTest : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kNumBefore = 4;
  static constexpr KeyframeId kLast{kNumBefore - 1};
  static constexpr double kUnit = 2.5;  ///< Of the new part, in units of the map.

  ScaleKeeperTest() : scene_(1, cloud_ahead(), {.seed = 4, .pixel_sigma = 0.3}, false) {}

  static Rigid3 path(double keyframe) { return pose_at(0.4 * keyframe, 0.05 * keyframe); }

  void map_before() {
    for (std::uint32_t k = 0; k < kNumBefore; ++k) scene_.add_keyframe(path(k));
  }

  /// Two views of the cloud, in units of their own, the first being the world.
  NewSubmap start(double first, double second) const {
    NewSubmap start;
    std::vector<PointObservation> views;
    std::vector<std::vector<std::uint32_t>> feature_of_point;
    for (const double at : {first, second}) {
      const auto number = static_cast<std::uint32_t>(10 + views.size());
      views.push_back(scene_.look(path(at), number));
      Rigid3 rig_from_first = path(at).inverse() * path(first);
      rig_from_first.translation /= kUnit;
      start.keyframes.push_back(
          {FrameId{number}, std::llround(1e8 * at), rig_from_first, views.back().features});
      feature_of_point.emplace_back(scene_.cloud.landmarks.size(), kNoFeature);
      for (std::uint32_t i = 0; i < views.back().features->num_primary; ++i) {
        const std::uint32_t point = views.back().landmark_of_feature[i];
        if (point != kNoLandmark) feature_of_point.back()[point] = i;
      }
    }
    for (std::size_t point = 0; point < scene_.cloud.landmarks.size(); ++point) {
      const std::uint32_t a = feature_of_point[0][point], b = feature_of_point[1][point];
      if (a == kNoFeature || b == kNoFeature) continue;
      const Eigen::Vector3d in_first =
          path(first).inverse() * scene_.cloud.landmarks[point].position;
      start.landmarks.push_back({in_first / kUnit, {a, b}});
    }
    return start;
  }

  TestMap scene_;
};

TEST_F(ScaleKeeperTest, WhoGoesOnAsFastTellsTheScale) {
  map_before();
  const auto scale = scale_by_speed(scene_.map, kLast, start(8.0, 9.5));
  ASSERT_TRUE(scale);
  EXPECT_NEAR(*scale, kUnit, 1e-6);
}

TEST_F(ScaleKeeperTest, OneKeyframeHasNoSpeed) {
  scene_.add_keyframe(path(0));
  EXPECT_FALSE(scale_by_speed(scene_.map, KeyframeId{0}, start(8.0, 9.5)));
}

TEST_F(ScaleKeeperTest, WhoStoodStillTellsNothingBySpeed) {
  for (int k = 0; k < 4; ++k) scene_.add_keyframe(path(0));
  EXPECT_FALSE(scale_by_speed(scene_.map, KeyframeId{3}, start(8.0, 9.5)));
}

TEST_F(ScaleKeeperTest, ScalingLeavesWhatIsSeen) {
  Initialization part{start(6.0, 7.0), {}, {}};
  part.rig_from_world = part.submap.keyframes.back().rig_from_world;
  part.filled.push_back({FrameId{9}, {KeyframeId{0}, 1.0, part.rig_from_world}, nullptr});
  const Initialization before = part;
  scale_by(kUnit, part);
  for (std::size_t k = 0; k < part.submap.keyframes.size(); ++k) {
    for (std::size_t i = 0; i < part.submap.landmarks.size(); ++i) {
      const auto in_rig = [&](const NewSubmap& submap) -> Eigen::Vector3d {
        return submap.keyframes[k].rig_from_world * submap.landmarks[i].position_in_world;
      };
      ASSERT_TRUE(in_rig(part.submap).isApprox(kUnit * in_rig(before.submap), 1e-9));
    }
  }
  const Eigen::Vector3d moved = kUnit * before.rig_from_world.translation;
  EXPECT_TRUE(part.rig_from_world.translation.isApprox(moved));
  EXPECT_TRUE(part.filled[0].pose.rig_from_reference.translation.isApprox(moved));
}

TEST_F(ScaleKeeperTest, TellsWhichPartsShareAUnitUntilTheyAreOne) {
  map_before();
  ScaleTransfer keeper;
  Initialization part{start(6.0, 8.0), {}, {}};
  keeper.keep(scene_.map, kLast, part);
  EXPECT_TRUE(keeper.kept_in(scene_.map).empty());  // The map is yet to get the part.
  const SubmapId submap = scene_.map.add_submap(false);
  Keyframe keyframe = scene_.map.keyframes().at(KeyframeId{0});
  keyframe.submap = submap;
  keyframe.frame = FrameId{10};
  keyframe.parent = {};
  keyframe.landmarks.clear();
  scene_.map.add_keyframe(std::move(keyframe));
  const std::vector<TransferredScale> kept = keeper.kept_in(scene_.map);
  ASSERT_EQ(kept.size(), 1u);
  EXPECT_EQ(kept[0].submap, submap);
  EXPECT_EQ(kept[0].before, scene_.submap);
  EXPECT_TRUE(keeper.kept_in(Map()).empty());
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/seen_through.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "waymark/track/test_map.h"

namespace waymark {
namespace {

constexpr std::uint32_t kBefore = 3;

/// A wall 6 m away and a box 2 m before it, which is there for the first three keyframes only.
class SeenThrough : public ::testing::Test {
 protected:
  SeenThrough()
      : wall_(scatter_in({-4.0, -3.0, 6.0}, {4.0, 3.0, 6.1}, 1200, 6.0, 3)),
        box_(scatter_in({-0.8, -0.8, 4.0}, {0.8, 0.8, 4.1}, 80, 4.0, 5)) {}

  /// num_after: keyframes after the box has gone, or with everything still there.
  TestMap look(std::uint32_t num_after, bool is_gone, double wall_m = 6.0) {
    PointCloud wall = wall_;
    for (PointLandmark& point : wall.landmarks) point.position.z() += wall_m - 6.0;
    TestMap scene(1, with_box(wall, box_, Rigid3()), {}, true);
    for (std::uint32_t k = 0; k < kBefore; ++k) scene.add_keyframe(row_pose(k));
    if (is_gone) {
      for (std::size_t i = wall.landmarks.size(); i < scene.cloud.landmarks.size(); ++i) {
        scene.cloud.landmarks[i].position.z() = -50.0;
      }
    }
    for (std::uint32_t k = 0; k < num_after; ++k) scene.add_keyframe(row_pose(k));
    return scene;
  }

  /// Of the box, as the map has it.
  std::size_t num_of_box(const TestMap& scene, const std::vector<LandmarkId>& landmarks) const {
    return static_cast<std::size_t>(
        std::count_if(landmarks.begin(), landmarks.end(), [&](LandmarkId id) {
          return scene.point_of_landmark.at(id) >= wall_.landmarks.size();
        }));
  }

  const PointCloud wall_;
  const PointCloud box_;
};

TEST_F(SeenThrough, FindsWhatIsGoneAndNothingElse) {
  const TestMap scene = look(5, true);
  const std::vector<LandmarkId> found = find_seen_through(scene.map);
  EXPECT_GT(found.size(), 60u);
  EXPECT_EQ(num_of_box(scene, found), found.size());
  EXPECT_TRUE(std::ranges::is_sorted(found));
}

TEST_F(SeenThrough, TwoLooksAreNotEnough) {
  EXPECT_TRUE(find_seen_through(look(2, true).map).empty());
}

TEST_F(SeenThrough, KeepsWhatIsStillThere) {
  EXPECT_TRUE(find_seen_through(look(3, false).map).empty());
}

TEST_F(SeenThrough, KeepsWhatWasMissedThoughNothingIsBeyondIt) {
  // Every other landmark of the wall and of the box is not found again.
  TestMap scene = look(0, false);
  for (std::uint32_t k = 0; k < 3; ++k) scene.add_keyframe(row_pose(k), 2);
  EXPECT_TRUE(find_seen_through(scene.map).empty());
}

TEST_F(SeenThrough, KeepsWhatIsHidden) {
  // The wall's landmarks behind a box that came: what is around them lies before them.
  TestMap scene(1, with_box(wall_, box_, Rigid3()), {}, true);
  const PointCloud with = scene.cloud;
  for (std::size_t i = wall_.landmarks.size(); i < scene.cloud.landmarks.size(); ++i) {
    scene.cloud.landmarks[i].position.z() = -50.0;
  }
  for (std::uint32_t k = 0; k < kBefore; ++k) scene.add_keyframe(row_pose(k));
  scene.cloud = with;
  for (PointLandmark& point : scene.cloud.landmarks) {
    const Eigen::Vector3d& at = point.position;
    if (at.z() > 5.0 && std::abs(at.x()) < 1.5 && std::abs(at.y()) < 1.5)
      point.position.z() = -50.0;
  }
  for (std::uint32_t k = 0; k < 3; ++k) scene.add_keyframe(row_pose(k));
  EXPECT_TRUE(find_seen_through(scene.map).empty());
}

TEST_F(SeenThrough, KeepsWhatMayBeAsFarAway) {
  // A wall 20 cm behind the front of what is gone.
  EXPECT_TRUE(find_seen_through(look(3, true, 4.3).map).empty());
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/triangulate.h"

#include <gtest/gtest.h>

#include <cmath>

#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

/// Two keyframes that share every third landmark: the others are there to be found.
class TriangulateTest : public ::testing::Test {
 protected:
  explicit TriangulateTest(double baseline_m = 0.5)
      : scene_(1, cloud_ahead(), {.seed = 6, .outlier_share = 0.1}, false) {
    scene_.add_keyframe(pose_at(0.0), 3);
    newest_ = scene_.add_keyframe(pose_at(baseline_m), 3);
  }

  std::vector<LandmarkId> triangulate() {
    return triangulate_with_neighbours(scene_.map, newest_, matcher_, dirty_);
  }

  /// The point of the cloud that a feature of a keyframe shows.
  std::uint32_t shown(const Observation& observation) const {
    return scene_.seen[observation.keyframe.value].landmark_of_feature[observation.feature];
  }

  TestMap scene_;
  KeyframeId newest_;
  EpipolarMatcher matcher_;
  DirtyLandmarks dirty_;
};

class TriangulateAtTheSamePlace : public TriangulateTest {
 protected:
  TriangulateAtTheSamePlace() : TriangulateTest(0.001) {}
};

TEST_F(TriangulateTest, FindsLandmarksWhereThePointsAre) {
  const auto before = scene_.map.keyframes().at(newest_).landmarks;
  const std::vector<LandmarkId> added = triangulate();
  EXPECT_EQ(scene_.map.broken_invariants(), "");
  EXPECT_GT(added.size(), 100u);
  EXPECT_EQ(dirty_.size(), added.size());
  std::size_t num_wrong = 0;
  std::vector<double> errors;
  for (const LandmarkId id : added) {
    const Landmark& landmark = scene_.map.landmarks().at(id);
    ASSERT_EQ(landmark.observations.size(), 2u);
    const std::uint32_t index = shown(landmark.observations[0]);
    if (index == kNoLandmark || index != shown(landmark.observations[1])) {
      ++num_wrong;
      continue;
    }
    const Eigen::Vector3d& point = scene_.cloud.landmarks[index].position;
    const double range = point.norm();  // From the first keyframe, which stands at the origin.
    const double across = 0.5 * Eigen::Vector3d::UnitX().cross(point / range).norm();
    const std::uint32_t feature = landmark.observations[0].feature;
    const double parallax_sigma_rad =
        std::sqrt(2.0) * scene_.noise.pixel_sigma * scene_.seen[0].features->size_rad[feature];
    errors.push_back((landmark.position_in_world.norm() - range) /
                     (range * range * parallax_sigma_rad / across));
  }
  // A wrong match must be on the curve by chance: 2 px to either side of 480, and alike.
  EXPECT_LT(num_wrong, added.size() / 50);
  // Ranges are as good as the noise lets them be: standard normal errors, less what the gate cut.
  double squares = 0.0;
  for (const double error : errors) squares += error * error;
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(errors.size())), 1.0, 0.2);
  // What was associated before is so still.
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i].is_valid()) {
      EXPECT_EQ(scene_.map.keyframes().at(newest_).landmarks[i], before[i]);
    }
  }
}

TEST_F(TriangulateTest, FindsThemOnce) {
  EXPECT_FALSE(triangulate().empty());
  EXPECT_TRUE(triangulate().empty());
}

TEST_F(TriangulateAtTheSamePlace, FindsNothing) { EXPECT_TRUE(triangulate().empty()); }

TEST_F(TriangulateTest, NeedsNeighbours) {
  const KeyframeId alone = scene_.add_bare_keyframe(pose_at(1.0));
  EXPECT_TRUE(triangulate_with_neighbours(scene_.map, alone, matcher_, dirty_).empty());
}

}  // namespace
}  // namespace waymark

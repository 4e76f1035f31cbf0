// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/match/epipolar.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "waymark/match/testing/scene.h"

namespace waymark {
namespace {

using Eigen::Vector3d;

class Epipolar : public ::testing::TestWithParam<Vector3d> {
 protected:
  std::span<const FeatureMatch> match(const EpipolarOptions& options = {}) {
    is_taken_a_.resize(a_.features->num_primary);
    is_taken_b_.resize(b_.features->num_primary);
    return matcher_.match(*a_.features, is_taken_a_, *b_.features, is_taken_b_, b_from_a_, options);
  }

  void see_from(const Vector3d& position) {
    const Rigid3 a_from_b = make_test_pose(position, {0.02, -0.03, 0.1});
    PointNoise noise;
    noise.max_features = 3000;
    b_from_a_ = a_from_b.inverse();
    a_ = observe(cloud_, rig_, Rigid3(), noise, 0);
    b_ = observe(cloud_, rig_, a_from_b, noise, 1);
  }

  /// Angle between the rays to a landmark, in pixels of the coarser feature's level.
  double parallax_px(std::uint32_t feature_a, std::uint32_t feature_b) const {
    const Vector3d ray_a = a_.features->bearings[feature_a].cast<double>();
    const Vector3d ray_b =
        b_from_a_.inverse().rotation * b_.features->bearings[feature_b].cast<double>();
    return std::acos(std::min(1.0, ray_a.dot(ray_b))) /
           std::max(a_.features->size_rad[feature_a], b_.features->size_rad[feature_b]);
  }

  /// Features of b by landmark.
  std::map<std::uint32_t, std::uint32_t> features_of_b() const {
    std::map<std::uint32_t, std::uint32_t> features;
    for (std::uint32_t i = 0; i < b_.features->num_primary; ++i) {
      features[b_.landmark_of_feature[i]] = i;
    }
    return features;
  }

  const std::shared_ptr<const Rig> rig_ = make_test_rig(1);
  const PointCloud cloud_ = scatter_in({-4.0, -3.0, 3.0}, {4.0, 3.0, 7.0}, 1500, 4.0, 3);
  Rigid3 b_from_a_;
  PointObservation a_, b_;
  std::vector<std::uint8_t> is_taken_a_, is_taken_b_;
  EpipolarMatcher matcher_;
};

TEST_P(Epipolar, FindsTheFeaturesOfTheSamePoint) {
  see_from(GetParam());
  const auto of_b = features_of_b();
  int num_possible = 0;
  for (std::uint32_t i = 0; i < a_.features->num_primary; ++i) {
    const auto other = of_b.find(a_.landmark_of_feature[i]);
    // Well above the least parallax, away from the epipole.
    num_possible += other != of_b.end() && parallax_px(i, other->second) > 8.0;
  }
  int num_right = 0;
  const auto matches = match();
  for (const FeatureMatch& match : matches) {
    num_right += a_.landmark_of_feature[match.a] == b_.landmark_of_feature[match.b];
    EXPECT_GT(parallax_px(match.a, match.b), 3.99);
  }
  ASSERT_GT(num_possible, 50);
  EXPECT_GT(num_right, 0.9 * num_possible);
  EXPECT_LE(static_cast<double>(matches.size()) - num_right, 0.02 * num_right + 1.0);
}

// Azimuth is counted from an axis that depends on the baseline: in all of these directions some
// features lie on either side of the jump by a full turn, most of all when moving forward.
INSTANTIATE_TEST_SUITE_P(Motions,
                         Epipolar,
                         ::testing::Values(Vector3d(0.4, 0.0, 0.0),
                                           Vector3d(-0.4, 0.0, 0.0),
                                           Vector3d(0.0, 0.4, 0.0),
                                           Vector3d(0.0, -0.4, 0.0),
                                           Vector3d(0.0, 0.0, 0.8),
                                           Vector3d(0.0, 0.0, -0.8),
                                           Vector3d(0.3, 0.2, -0.5)));

TEST_F(Epipolar, MatchesAcrossTheJumpOfAzimuth) {
  see_from({0.0, 0.0, 0.8});
  // All around the axis of motion: matches are found in every one of 36 sectors.
  std::vector<int> sectors(36, 0);
  for (const FeatureMatch& match : match()) {
    const Eigen::Vector3f& bearing = a_.features->bearings[match.a];
    const double turn = std::atan2(bearing.y(), bearing.x()) / (2.0 * std::numbers::pi) + 0.5;
    ++sectors[static_cast<std::size_t>(turn * 35.999)];
  }
  for (const int count : sectors) EXPECT_GT(count, 0);
}

TEST_F(Epipolar, MatchesNothingBelowTheLeastParallax) {
  see_from({0.01, 0.0, 0.0});  // 1.4 pixels of level 0 for the nearest point.
  EXPECT_LT(match().size(), 5u);
}

TEST_F(Epipolar, MatchesNothingAboveTheGreatestParallax) {
  see_from({0.4, 0.0, 0.0});
  // Even the farthest point has 0.03 rad.
  EXPECT_LT(match({.max_parallax_rad = 0.02}).size(), 3u);
}

TEST_F(Epipolar, LeavesTakenFeaturesOut) {
  see_from({0.4, 0.0, 0.0});
  is_taken_a_.assign(a_.features->num_primary, 0);
  is_taken_b_.assign(b_.features->num_primary, 0);
  for (std::size_t i = 0; i < is_taken_a_.size(); i += 2) is_taken_a_[i] = 1;
  for (std::size_t i = 0; i < is_taken_b_.size(); i += 3) is_taken_b_[i] = 1;
  const auto matches = match();
  EXPECT_GT(matches.size(), 30u);
  for (const FeatureMatch& match : matches) {
    EXPECT_FALSE(is_taken_a_[match.a]);
    EXPECT_FALSE(is_taken_b_[match.b]);
  }
}

TEST_F(Epipolar, MatchesOneToOne) {
  see_from({0.4, 0.0, 0.0});
  std::map<std::uint32_t, int> uses;
  for (const FeatureMatch& match : match()) EXPECT_EQ(++uses[match.b], 1);
  EXPECT_GT(uses.size(), 50u);
}

}  // namespace
}  // namespace waymark

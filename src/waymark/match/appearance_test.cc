// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/match/appearance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "waymark/match/testing/scene.h"

namespace waymark {
namespace {

class AppearanceTest : public ::testing::Test {
 protected:
  PointObservation see(const Rigid3& world_from_rig, std::uint64_t frame) const {
    return observe(cloud_, rig_, world_from_rig, PointNoise(), frame);
  }

  std::span<const FeatureMatch> match_all(const Features& a, const Features& b) {
    std::vector<std::uint32_t> indices(a.num_primary);
    std::iota(indices.begin(), indices.end(), 0u);
    return matcher_.match_all(a, indices, b, {});
  }

  static std::size_t num_right(std::span<const FeatureMatch> matches,
                               const PointObservation& a,
                               const PointObservation& b) {
    return static_cast<std::size_t>(
        std::count_if(matches.begin(), matches.end(), [&](const FeatureMatch& match) {
          return a.landmark_of_feature[match.a] == b.landmark_of_feature[match.b];
        }));
  }

  static std::size_t num_common(const PointObservation& a, const PointObservation& b) {
    const std::set<std::uint32_t> of_a(a.landmark_of_feature.begin(), a.landmark_of_feature.end());
    return static_cast<std::size_t>(std::count_if(
        b.landmark_of_feature.begin(), b.landmark_of_feature.end(), [&](std::uint32_t landmark) {
          return of_a.contains(landmark);
        }));
  }

  const std::shared_ptr<const Rig> rig_ = make_test_rig(1);
  const PointCloud cloud_ = scatter_in({-4.0, -3.0, 3.0}, {4.0, 3.0, 7.0}, 1500, 4.0, 3);
  AppearanceMatcher matcher_;
};

TEST_F(AppearanceTest, MatchesTwoViewsOneToOne) {
  const PointObservation a = see(Rigid3(), 0);
  const PointObservation b = see(make_test_pose({0.2, 0.0, 0.1}, {0.0, 0.0, 0.5}), 1);
  const auto matches = match_all(*a.features, *b.features);
  std::set<std::uint32_t> used_a;
  std::set<std::uint32_t> used_b;
  for (const FeatureMatch& match : matches) {
    EXPECT_TRUE(used_a.insert(match.a).second);
    EXPECT_TRUE(used_b.insert(match.b).second);
  }
  EXPECT_GT(static_cast<double>(num_right(matches, a, b)),
            0.9 * static_cast<double>(num_common(a, b)));
  EXPECT_EQ(num_right(matches, a, b), matches.size());
}

TEST_F(AppearanceTest, DropsMatchesThatTurnAgainstTheRest) {
  const PointObservation a = see(Rigid3(), 0);
  Features turned = *a.features;
  for (std::size_t i = 0; i < turned.num_primary; i += 5) turned.keypoints[i].angle_rad += 1.5f;
  const auto matches = match_all(*a.features, turned);
  EXPECT_GT(matches.size(), turned.num_primary / 2);
  for (const FeatureMatch& match : matches) EXPECT_NE(match.b % 5, 0u);
}

TEST_F(AppearanceTest, KeepsAllWhereTheImageDoesNotTurnAsOne) {
  const PointObservation a = see(Rigid3(), 0);
  Features turned = *a.features;  // As a camera that sees all round sees it when it tilts.
  for (std::size_t i = 0; i < turned.num_primary; ++i) {
    const float turns =
        turned.keypoints[i].x_px / static_cast<float>(rig_->cameras[0].camera->width_px());
    turned.keypoints[i].angle_rad += 0.7f * std::sin(6.2831853f * turns);
  }
  EXPECT_EQ(match_all(*a.features, turned).size(), a.features->num_primary);
}

TEST_F(AppearanceTest, VotesAroundTheFullTurn) {
  const PointObservation a = see(Rigid3(), 0);
  Features turned = *a.features;
  // Changes of a few degrees to either side of zero, that is of a full turn.
  for (std::size_t i = 0; i < turned.num_primary; ++i) {
    turned.keypoints[i].angle_rad += i % 2 == 0 ? 0.05f : -0.05f;
  }
  EXPECT_EQ(match_all(*a.features, turned).size(), a.features->num_primary);
}

TEST_F(AppearanceTest, NearLooksOnlyWithinTheWindow) {
  const PointObservation a = see(Rigid3(), 0);
  const PointObservation b = see(make_test_pose({0.02, 0.0, 0.0}, {0.0, 0.0, 0.0}), 1);
  std::vector<Eigen::Vector2f> expected;
  for (std::size_t i = 0; i < a.features->num_primary; ++i) {
    expected.emplace_back(a.features->keypoints[i].x_px, a.features->keypoints[i].y_px);
  }
  const auto matches = matcher_.match_near(*a.features, expected, 20.0, *b.features, {});
  EXPECT_GT(static_cast<double>(num_right(matches, a, b)),
            0.9 * static_cast<double>(num_common(a, b)));
  for (Eigen::Vector2f& pixel : expected) pixel.x() += pixel.x() < 320.0f ? 150.0f : -150.0f;
  EXPECT_LT(matcher_.match_near(*a.features, expected, 20.0, *b.features, {}).size(), 5u);
}

TEST_F(AppearanceTest, NothingMatchesNothing) {
  const PointObservation a = see(Rigid3(), 0);
  const Features none;
  EXPECT_TRUE(match_all(*a.features, none).empty());
  EXPECT_TRUE(match_all(none, *a.features).empty());
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/frame_locator.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>

#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

/// Two keyframes, and a view between them to be located.
class FrameLocatorTest : public ::testing::TestWithParam<int> {
 protected:
  FrameLocatorTest() : scene_(GetParam(), cloud_ahead(), {.seed = 5}, true) {
    scene_.add_keyframe(pose_at(0.0));
    scene_.add_keyframe(pose_at(0.5));
    view_ = scene_.look(truth_, 100);
    landmarks_ = scene_.true_associations(view_);
  }

  LocatedFrame locate() {
    const Rigid3 guess =
        Rigid3::exp((Vector6d() << 0.05, -0.03, 0.04, 0.01, -0.02, 0.01).finished()) *
        truth_.inverse();
    LocatedFrame located = locator_.locate(*view_.features, scene_.map, guess, landmarks_);
    landmarks_ = located.landmarks;
    return located;
  }

  const Rigid3 truth_ = pose_at(0.3, 0.1, 0.2, 0.03);
  TestMap scene_;
  FrameLocator locator_;
  PointObservation view_;
  std::vector<LandmarkId> landmarks_;  ///< Of the view, as the matcher would find them.
};

TEST_P(FrameLocatorTest, FindsThePoseWithinItsCovariance) {
  const LocatedFrame located = locate();
  const Vector6d error = (located.rig_from_world * truth_).log();
  EXPECT_LT(error.head<3>().norm(), 0.02);
  EXPECT_LT(error.tail<3>().norm(), 0.004);
  // 99.99 % of chi-square with 6 degrees of freedom.
  EXPECT_LT(error.dot(located.covariance.ldlt().solve(error)), 27.9);
  EXPECT_GT(located.num_inliers, 200);
  EXPECT_GE(located.num_matches, located.num_inliers);
}

TEST_P(FrameLocatorTest, ClearsWrongAssociationsAndKeepsRightOnes) {
  const std::vector<LandmarkId> truth = landmarks_;
  std::vector<std::uint32_t> with_landmark;
  for (std::uint32_t i = 0; i < view_.features->num_primary; ++i) {
    if (truth[i].is_valid()) with_landmark.push_back(i);
  }
  // Each fourth gets the landmark of one that is far away in the list, hence in the image.
  const std::size_t half = with_landmark.size() / 2;
  std::vector<std::uint32_t> wrong;
  for (std::size_t k = 0; k < half; k += 4) {
    wrong.push_back(with_landmark[k]);
    landmarks_[with_landmark[k]] = truth[with_landmark[k + half]];
    landmarks_[with_landmark[k + half]] = LandmarkId{};
  }
  const LocatedFrame located = locate();
  std::size_t num_wrong_kept = 0;
  for (const std::uint32_t i : wrong) num_wrong_kept += landmarks_[i].is_valid();
  EXPECT_LE(num_wrong_kept, wrong.size() / 20);
  std::size_t num_right_kept = 0;
  int num_valid = 0;
  for (const std::uint32_t i : with_landmark) {
    num_right_kept += landmarks_[i].is_valid() && landmarks_[i] == truth[i];
    num_valid += landmarks_[i].is_valid();
  }
  // The gate keeps 95 % of those with 1 px of noise, hence more of these.
  const std::size_t num_right = with_landmark.size() - 2 * wrong.size();
  EXPECT_GE(num_right_kept, num_right * 95 / 100);
  EXPECT_EQ(located.num_inliers, num_valid);
  EXPECT_LT((located.rig_from_world * truth_).log().head<3>().norm(), 0.02);
}

TEST_P(FrameLocatorTest, IsNotMisledByWrongRanges) {
  auto damaged = std::make_shared<Features>(*view_.features);
  for (std::uint32_t i = 0; i < damaged->num_primary; i += 10) damaged->range_m[i] *= 0.5f;
  view_.features = damaged;
  const LocatedFrame located = locate();
  EXPECT_LT((located.rig_from_world * truth_).log().head<3>().norm(), 0.02);
  for (std::size_t i = damaged->num_primary; i < damaged->size(); ++i) {
    EXPECT_FALSE(landmarks_[i].is_valid()) << "features of camera 1 show none of their own";
  }
}

TEST_P(FrameLocatorTest, WithoutLandmarksTheGuessComesBack) {
  landmarks_.assign(landmarks_.size(), LandmarkId{});
  const Rigid3 guess = truth_.inverse();
  const LocatedFrame located = locator_.locate(*view_.features, scene_.map, guess, landmarks_);
  EXPECT_EQ(located.num_matches, 0);
  EXPECT_EQ(located.num_inliers, 0);
  EXPECT_TRUE(located.rig_from_world.matrix().isApprox(guess.matrix(), 1e-12));
}

TEST_P(FrameLocatorTest, LocatedAgainRestsOnWhatElseTheSetShows) {
  LandmarkSet all;
  scene_.map.landmarks().for_each(
      [&](LandmarkId id, const Landmark& landmark) { all.add(id, landmark); });
  const std::vector<LandmarkId> truth = landmarks_;
  for (std::size_t i = 0; i < view_.features->num_primary; ++i) {
    if (i % 5 != 0) landmarks_[i] = LandmarkId{};
  }
  const LocatedFrame first = locate();
  const LocatedFrame again =
      locator_.locate_again(*view_.features, scene_.map, first, all, {.radius_px = 5.0});
  EXPECT_GT(again.num_inliers, 3 * first.num_inliers);
  std::vector<LandmarkId> shown = primary_landmarks(*view_.features, again.landmarks);
  EXPECT_EQ(static_cast<int>(shown.size()), again.num_inliers);
  std::sort(shown.begin(), shown.end());
  EXPECT_EQ(std::adjacent_find(shown.begin(), shown.end()), shown.end()) << "one feature each";
  int num_wrong = 0;
  for (std::size_t i = 0; i < view_.features->num_primary; ++i) {
    num_wrong += again.landmarks[i].is_valid() && again.landmarks[i] != truth[i];
  }
  EXPECT_LT(num_wrong, again.num_inliers / 50);
  // All of the set that the view shows should have been seen.
  EXPECT_GE(std::ssize(again.visible), num_valid(shown));
}

INSTANTIATE_TEST_SUITE_P(Cameras, FrameLocatorTest, ::testing::Values(1, 2), [](const auto& info) {
  return info.param == 1 ? "mono" : "stereo";
});

}  // namespace
}  // namespace waymark

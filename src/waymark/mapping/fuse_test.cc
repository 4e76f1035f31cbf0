// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/fuse.h"

#include <gtest/gtest.h>

#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

/// Three keyframes with associations, of which tests take some away or apart.
class FuseTest : public ::testing::Test {
 protected:
  FuseTest() : scene_(1, cloud_ahead(), {.seed = 9}, false) {
    for (const double x : {0.0, 0.2, 0.4}) newest_ = scene_.add_keyframe(pose_at(x));
  }

  void fuse() {
    fuse_with_neighbours(scene_.map, newest_, matcher_, dirty_);
    ASSERT_EQ(scene_.map.broken_invariants(), "");
  }

  /// Observations that the feature's own point does not explain.
  int count_wrong() const {
    int count = 0;
    scene_.map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
      for (std::uint32_t i = 0; i < keyframe.features->num_primary; ++i) {
        if (!keyframe.landmarks[i].is_valid()) continue;
        const Eigen::Vector3d& position =
            scene_.map.landmarks().at(keyframe.landmarks[i]).position_in_world;
        const std::uint32_t index = scene_.seen[id.value].landmark_of_feature[i];
        count += position != scene_.cloud.landmarks[index].position;
      }
    });
    return count;
  }

  int count_observations() const {
    int count = 0;
    scene_.map.landmarks().for_each([&](LandmarkId, const Landmark& landmark) {
      count += static_cast<int>(landmark.observations.size());
    });
    return count;
  }

  TestMap scene_;
  KeyframeId newest_;
  ProjectionMatcher matcher_;
  DirtyLandmarks dirty_;
};

TEST_F(FuseTest, LeavesASoundMapAlone) {
  const std::size_t num_landmarks = scene_.map.landmarks().size();
  const int num_observations = count_observations();
  fuse();
  EXPECT_EQ(scene_.map.landmarks().size(), num_landmarks);
  EXPECT_EQ(count_observations(), num_observations);
  EXPECT_EQ(count_wrong(), 0);
}

TEST_F(FuseTest, FindsObservationsThatAreMissing) {
  const int num_observations = count_observations();
  int num_taken = 0;
  for (std::uint32_t i = 0; i < scene_.seen[newest_.value].features->num_primary; i += 2) {
    const LandmarkId landmark = scene_.map.keyframes().at(newest_).landmarks[i];
    if (!landmark.is_valid() || num_observers(scene_.map.landmarks().at(landmark)) < 3) continue;
    scene_.map.forget(newest_, i);
    ++num_taken;
  }
  ASSERT_GT(num_taken, 50);
  fuse();
  // The gate keeps 95 % with 1 px of noise, and there is half of it; some look too different.
  EXPECT_GE(count_observations(), num_observations - num_taken / 10);
  EXPECT_LE(count_wrong(), num_taken / 50);
  EXPECT_GE(dirty_.size(), static_cast<std::size_t>(num_taken * 9 / 10));
}

TEST_F(FuseTest, MergesLandmarksThatAreOneAndTheSame) {
  const std::size_t num_landmarks = scene_.map.landmarks().size();
  // The newest keyframe gets landmarks of its own for points that the others know.
  std::vector<std::pair<LandmarkId, LandmarkId>> twins;
  for (std::uint32_t i = 0; i < scene_.seen[newest_.value].features->num_primary; i += 2) {
    const LandmarkId original = scene_.map.keyframes().at(newest_).landmarks[i];
    if (!original.is_valid() || num_observers(scene_.map.landmarks().at(original)) < 3) continue;
    const Landmark landmark = scene_.map.landmarks().at(original);
    scene_.map.forget(newest_, i);
    const LandmarkId twin =
        scene_.map.add_landmark(scene_.submap, landmark.position_in_world, newest_);
    scene_.map.set_appearance(twin, landmark.appearance);
    scene_.map.observe(newest_, i, twin);
    twins.emplace_back(original, twin);
  }
  ASSERT_GT(twins.size(), 50u);
  fuse();
  std::size_t num_merged = 0;
  for (const auto& [original, twin] : twins) {
    num_merged += scene_.map.resolve(twin) == original;
    EXPECT_TRUE(scene_.map.landmarks().contains(original)) << "it had more observers";
    if (!scene_.map.landmarks().contains(twin)) {
      EXPECT_EQ(dirty_.count(twin), 0u);
    }
  }
  EXPECT_GE(num_merged, twins.size() * 9 / 10);
  EXPECT_EQ(scene_.map.landmarks().size(), num_landmarks + twins.size() - num_merged);
  EXPECT_EQ(count_wrong(), 0);
}

TEST_F(FuseTest, KeepsWhatOnlyLooksAlikeApart) {
  const LandmarkId landmark{0};
  const Landmark twin = scene_.map.landmarks().at(landmark);
  // Half a metre beside, hence some 40 px.
  const LandmarkId id = scene_.map.add_landmark(
      scene_.submap, twin.position_in_world + Eigen::Vector3d(0.0, 0.5, 0.0), newest_);
  scene_.map.set_appearance(id, twin.appearance);
  fuse();
  EXPECT_TRUE(scene_.map.landmarks().contains(id));
  EXPECT_TRUE(scene_.map.landmarks().contains(landmark));
}

}  // namespace
}  // namespace waymark

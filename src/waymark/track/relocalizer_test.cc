// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/relocalizer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

PointCloud another_cloud(std::uint64_t seed) {
  return scatter_in({-5.0, -3.0, 4.0}, {5.0, 3.0, 9.0}, 1500, 6.0, seed);
}

/// Two places in a sub-map each, of four keyframes each.
class RelocalizerTest : public ::testing::Test {
 protected:
  RelocalizerTest() : scene_(1, cloud_ahead(), {.seed = 5}, false), relocalizer_({}, 1) {
    add_keyframes();
    first_ = std::exchange(scene_.cloud, another_cloud(11));
    scene_.submap = scene_.map.add_submap(false);
    scene_.landmark_of_point.clear();
    add_keyframes();
  }

  void add_keyframes() {
    for (const double x : {0.0, 0.4, 0.8, 1.2}) {
      const KeyframeId id = scene_.add_keyframe(pose_at(x));
      places_.add(id, scene_.submap, scene_.seen[id.value].features->descriptors);
    }
  }

  std::optional<LocatedFrame> locate(const PointCloud& cloud,
                                     const Rigid3& world_from_rig,
                                     const std::optional<LastPlace>& last = {}) {
    const auto view = observe(cloud, scene_.rig, world_from_rig, scene_.noise, 100);
    const Frame frame = {FrameId{100}, 0, view.features};
    return relocalizer_.locate(frame, scene_.map, places_, last);
  }

  SubmapId submap_of(const LocatedFrame& located) const {
    for (const LandmarkId id : located.landmarks) {
      if (id.is_valid()) return scene_.map.landmarks().at(id).submap;
    }
    return {};
  }

  TestMap scene_;
  PointCloud first_;
  PlaceIndex places_;
  Relocalizer relocalizer_;
};

TEST_F(RelocalizerTest, FindsFramesInTheSubmapThatShowsTheirPlace) {
  const Rigid3 truth = pose_at(0.5, 0.2, 0.6, 0.1);
  for (const std::uint32_t submap : {0u, 1u}) {
    const auto located = locate(submap == 0 ? first_ : scene_.cloud, truth);
    ASSERT_TRUE(located);
    EXPECT_EQ(relocalizer_.diagnosis().reason, FrameReason::kNone);
    EXPECT_LT((located->rig_from_world.origin_in_source() - truth.translation).norm(), 0.02);
    EXPECT_EQ(submap_of(*located), SubmapId{submap});
  }
}

TEST_F(RelocalizerTest, PrefersThePlaceThatExplainsMore) {
  // Half of a third place is as in the first, and the index thinks it the likelier one.
  PointCloud half_alike = another_cloud(13);
  for (std::size_t i = 0; i < half_alike.landmarks.size(); i += 2) {
    half_alike.landmarks[i] = first_.landmarks[i];
  }
  scene_.cloud = half_alike;
  scene_.submap = scene_.map.add_submap(false);
  scene_.landmark_of_point.clear();
  places_ = PlaceIndex();
  for (const std::uint32_t id : {0u, 1u, 2u, 3u}) {
    const FeatureArray<Descriptor>& all = scene_.seen[id].features->descriptors;
    places_.add(KeyframeId{id}, SubmapId{0}, std::span(all).first(all.size() / 4));
  }
  add_keyframes();
  const auto in_third = locate(half_alike, pose_at(0.5));
  ASSERT_TRUE(in_third);
  EXPECT_EQ(submap_of(*in_third), SubmapId{2});
  const auto in_first = locate(first_, pose_at(0.5));
  ASSERT_TRUE(in_first);
  EXPECT_EQ(submap_of(*in_first), SubmapId{0});
}

TEST_F(RelocalizerTest, BelievesNearTheLastPlaceWhatItWouldNotElsewhere) {
  // Only what is at the left is as it was.
  PointCloud changed = another_cloud(13);
  for (std::size_t i = 0; i < changed.landmarks.size(); ++i) {
    const PointLandmark& before = first_.landmarks[i];
    PointLandmark& now = changed.landmarks[i];
    now.position.x() = std::max(now.position.x(), -1.4);
    if (before.position.x() < -1.5) now = before;
  }
  const Rigid3 truth = pose_at(0.5, 0.1, 0.2);
  EXPECT_FALSE(locate(changed, truth));
  EXPECT_EQ(relocalizer_.diagnosis().reason, FrameReason::kNotVerified);
  EXPECT_LE(relocalizer_.diagnosis().num_inliers, relocalizer_.diagnosis().num_matches);
  EXPECT_FALSE(locate(changed, truth, LastPlace{KeyframeId{1}, pose_at(0.5, 8.0).inverse()}));
  const auto near = locate(changed, truth, LastPlace{KeyframeId{1}, pose_at(0.4).inverse()});
  ASSERT_TRUE(near);
  EXPECT_LT((near->rig_from_world.origin_in_source() - truth.translation).norm(), 0.03);
}

TEST_F(RelocalizerTest, SaysThatNoCandidateFits) {
  EXPECT_FALSE(locate(another_cloud(77), pose_at(0.5)));
  EXPECT_NE(relocalizer_.diagnosis().reason, FrameReason::kNone);
  // The looks of the place, but not its shape.
  for (PointLandmark& point : first_.landmarks) point.position.x() *= -1.0;
  EXPECT_FALSE(locate(first_, pose_at(0.5)));
  const FrameStatus& diagnosis = relocalizer_.diagnosis();
  EXPECT_EQ(diagnosis.reason, FrameReason::kNotVerified);
  EXPECT_GE(diagnosis.num_candidates, 2);
  EXPECT_GT(diagnosis.num_matches, 100);
  EXPECT_LT(diagnosis.num_inliers, diagnosis.num_matches / 2);
}

TEST_F(RelocalizerTest, SaysThatThereIsNoCandidate) {
  places_ = PlaceIndex();
  EXPECT_FALSE(locate(first_, pose_at(0.5)));
  EXPECT_EQ(relocalizer_.diagnosis().reason, FrameReason::kNoCandidate);
}

TEST_F(RelocalizerTest, LeavesOutKeyframesThatTheMapDoesNotHave) {
  scene_.map.erase_keyframe(KeyframeId{6});
  const auto view = observe(scene_.cloud, scene_.rig, pose_at(0.6), scene_.noise, 101);
  for (std::uint32_t id = 8; id < 30; ++id) {
    places_.add(KeyframeId{id}, SubmapId{1}, view.features->descriptors);
  }
  EXPECT_TRUE(locate(scene_.cloud, pose_at(0.6)));
}

}  // namespace
}  // namespace waymark

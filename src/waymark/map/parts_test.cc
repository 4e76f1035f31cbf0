// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/map/parts.h"

#include <gtest/gtest.h>

#include <set>

#include "waymark/map/testing/random_map.h"

namespace waymark {
namespace {

using testing::RandomMap;

TEST(MapParts, UniteKeepsBothMapsAsTheyAre) {
  RandomMap first(1), second(2);
  const Map& a = first.map();
  const Map& b = second.map();
  const Map both = unite(a, b);
  ASSERT_EQ(both.broken_invariants(), "");
  EXPECT_EQ(both.submaps().size(), a.submaps().size() + b.submaps().size());
  EXPECT_EQ(both.keyframes().size(), a.keyframes().size() + b.keyframes().size());
  EXPECT_EQ(both.landmarks().size(), a.landmarks().size() + b.landmarks().size());
  EXPECT_EQ(both.loop_edges().size(), a.loop_edges().size() + b.loop_edges().size());
  EXPECT_EQ(both.keyframes().end_id().value,
            a.keyframes().end_id().value + b.keyframes().end_id().value);
  const std::uint32_t shift = a.keyframes().end_id().value;
  b.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    const Keyframe& other = both.keyframes().at(KeyframeId{id.value + shift});
    EXPECT_EQ(other.features->descriptors, keyframe.features->descriptors);
    EXPECT_TRUE(is_same_rig(other.rig(), keyframe.rig()));
    EXPECT_EQ(other.rig_from_world.matrix(), keyframe.rig_from_world.matrix());
    EXPECT_EQ(other.submap.value, keyframe.submap.value + a.submaps().size());
    EXPECT_EQ(both.covisible(KeyframeId{id.value + shift}).size(), b.covisible(id).size());
  });
  EXPECT_EQ(both.odometry().size(), a.odometry().size() + b.odometry().size());
  b.odometry().for_each([&](KeyframeId id, const OdometryNode& node) {
    const OdometryNode& other = both.odometry().at(KeyframeId{id.value + shift});
    EXPECT_EQ(other.rig_from_parent.translation, node.rig_from_parent.translation);
    if (!node.parent.is_valid()) return;
    EXPECT_EQ(other.parent.value, node.parent.value + shift);
  });
}

TEST(MapParts, UniteKeepsWhatIdsStandFor) {
  RandomMap first(3), second(4);
  const Map& a = first.map();
  const Map& b = second.map();
  const Map both = unite(a, b);
  const KeyframeId end = a.keyframes().end_id();
  for (KeyframeId id{0}; id < b.keyframes().end_id(); ++id.value) {
    EXPECT_EQ(both.resolve(KeyframeId{id.value + end.value}).value,
              b.resolve(id).value + end.value);
  }
  const LandmarkId end_landmark = a.landmarks().end_id();
  for (LandmarkId id{0}; id < b.landmarks().end_id(); ++id.value) {
    const LandmarkId expected = b.resolve(id);
    const LandmarkId resolved = both.resolve(LandmarkId{id.value + end_landmark.value});
    EXPECT_EQ(resolved.is_valid(), expected.is_valid());
    if (!expected.is_valid()) continue;
    EXPECT_EQ(resolved.value, expected.value + end_landmark.value);
  }
}

TEST(MapParts, UniteNumbersFramesOnAndSharesRigs) {
  RandomMap first(5), second(5);
  std::set<std::uint32_t> frames;
  std::set<const Rig*> rigs;
  const Map both = unite(first.map(), second.map());
  both.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    EXPECT_TRUE(frames.insert(keyframe.frame.value).second);
    rigs.insert(keyframe.features->rig.get());
  });
  EXPECT_EQ(rigs.size(), 3u) << "three kinds in either map";
}

}  // namespace
}  // namespace waymark

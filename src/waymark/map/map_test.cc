// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/map/map.h"

#include <gtest/gtest.h>

namespace waymark {
namespace {

Keyframe make_keyframe(std::size_t num_features, SubmapId submap, KeyframeId parent) {
  auto features = std::make_shared<Features>();
  features->rig = std::make_shared<Rig>();
  features->keypoints.resize(num_features);
  features->num_primary = num_features;
  Keyframe keyframe;
  keyframe.submap = submap;
  keyframe.parent = parent;
  keyframe.features = features;
  return keyframe;
}

TEST(Map, ThawedMapsGoOnAndLeaveTheFrozenOneAlone) {
  Map original;
  const SubmapId submap = original.add_submap(true);
  const KeyframeId root = original.add_keyframe(make_keyframe(5, submap, {}));
  const LandmarkId landmark = original.add_landmark(submap, Eigen::Vector3d::Zero(), root);
  original.observe(root, 1, landmark);
  const auto frozen = original.freeze();
  Map thawed = Map::thaw(*frozen);
  const KeyframeId next = thawed.add_keyframe(make_keyframe(5, submap, root));
  thawed.observe(next, 2, landmark);
  EXPECT_EQ(next, KeyframeId{root.value + 1});
  EXPECT_EQ(thawed.broken_invariants(), "");
  EXPECT_EQ(thawed.covisible(root).size(), 1u);
  EXPECT_EQ(frozen->keyframes().size(), 1u);
  EXPECT_EQ(frozen->broken_invariants(), "");
}

TEST(Map, ReferencesToWhatWasThawedLastUntilTheNextFreeze) {
  Map original;
  const SubmapId submap = original.add_submap(true);
  const KeyframeId root = original.add_keyframe(make_keyframe(5, submap, {}));
  const LandmarkId landmark = original.add_landmark(submap, Eigen::Vector3d::Ones(), root);
  auto frozen = original.freeze();
  Map thawed = Map::thaw(*frozen);
  frozen.reset();
  original = Map();
  const Landmark& before = thawed.landmarks().at(landmark);
  thawed.move_landmark(landmark, Eigen::Vector3d::Zero());
  EXPECT_EQ(before.position_in_world, Eigen::Vector3d::Ones());
  EXPECT_EQ(thawed.landmarks().at(landmark).position_in_world, Eigen::Vector3d::Zero());
}

/// A map in which ids come and go, as in a room that is walked through again and again.
TEST(Map, RemembersWhatIsGoneOnlyAsLongAsSomeoneMayAsk) {
  Map map;
  const SubmapId submap = map.add_submap(true);
  Keyframe first = make_keyframe(5, submap, {});
  first.frame = FrameId{0};
  const KeyframeId root = map.add_keyframe(first);
  const LandmarkId lasting = map.add_landmark(submap, Eigen::Vector3d::Ones(), root);
  map.observe(root, 0, lasting);
  std::vector<LandmarkId> merged;
  for (std::uint32_t frame = 10; frame <= 30000; frame += 10) {
    for (int i = 0; i < 10; ++i) {
      map.erase_landmark(map.add_landmark(submap, Eigen::Vector3d::Ones(), root));
    }
    merged.push_back(map.add_landmark(submap, Eigen::Vector3d::Ones(), root));
    map.merge_landmarks(lasting, merged.back());
    Keyframe keyframe = make_keyframe(5, submap, root);
    keyframe.frame = FrameId{frame};
    map.erase_keyframe(map.add_keyframe(keyframe));
    // Those of the last 64 keyframes may wait to be dropped, and three are at the ends.
    ASSERT_LE(map.landmark_forwarding().size(), (Map::kRemembersMerged / 10) + 64 + 3);
  }
  EXPECT_EQ(map.broken_invariants(), "");
  EXPECT_EQ(map.keyframe_forwarding().size(), 3000u);
  for (std::size_t i = 0; i < Map::kRemembersMerged / 10; ++i) {
    EXPECT_EQ(map.resolve(merged[merged.size() - 1 - i]), lasting);
  }
  EXPECT_FALSE(map.resolve(merged.front()).is_valid());
}

TEST(Map, CountsDistinctKeyframesNotFeatures) {
  Map map;
  const SubmapId submap = map.add_submap(true);
  const KeyframeId a = map.add_keyframe(make_keyframe(4, submap, {}));
  const KeyframeId b = map.add_keyframe(make_keyframe(4, submap, a));
  const LandmarkId landmark = map.add_landmark(submap, Eigen::Vector3d::Ones(), a);
  map.observe(a, 0, landmark);
  map.observe(a, 2, landmark);
  map.observe(b, 1, landmark);
  map.observe(b, 3, landmark);
  EXPECT_EQ(num_observers(map.landmarks().at(landmark)), 2u);
  ASSERT_EQ(map.covisible(a).size(), 1u);
  EXPECT_EQ(map.covisible(a)[0].num_shared, 1u);
  map.forget(b, 1);
  EXPECT_EQ(map.covisible(a)[0].num_shared, 1u);
  map.forget(b, 3);
  EXPECT_TRUE(map.covisible(a).empty());
}

TEST(Map, PosesRelativeToAnErasedKeyframeFollowItsHeirWithScale) {
  Map map;
  const SubmapId submap = map.add_submap(false);
  const Rigid3 step(Eigen::Quaterniond::Identity(), {0.0, 0.0, -1.0});
  const KeyframeId root = map.add_keyframe(make_keyframe(1, submap, {}));
  Keyframe second = make_keyframe(1, submap, root);
  second.rig_from_world = step;
  const KeyframeId erased = map.add_keyframe(second);
  map.erase_keyframe(erased);
  EXPECT_EQ(map.resolve(erased), root);
  const Rigid3 rig_from_world = map.rig_from_world(erased, step, 1.0);
  EXPECT_NEAR(rig_from_world.translation.z(), -2.0, 1e-12);
}

TEST(Map, MergedIdsResolveToTheSurvivor) {
  Map map;
  const SubmapId submap = map.add_submap(false);
  const KeyframeId a = map.add_keyframe(make_keyframe(4, submap, {}));
  const LandmarkId first = map.add_landmark(submap, Eigen::Vector3d::Ones(), a);
  const LandmarkId second = map.add_landmark(submap, Eigen::Vector3d::Ones(), a);
  map.observe(a, 0, first);
  map.observe(a, 1, second);
  map.merge_landmarks(first, second);
  EXPECT_EQ(map.resolve(second), first);
  EXPECT_FALSE(map.keyframes().at(a).landmarks[1].is_valid());
  map.erase_landmark(first);
  EXPECT_FALSE(map.resolve(second).is_valid());
}

}  // namespace
}  // namespace waymark

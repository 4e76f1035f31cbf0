// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <functional>
#include <string>

#include "waymark/map/map.h"
#include "waymark/map/parts.h"
#include "waymark/map/testing/random_map.h"

namespace waymark {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using testing::RandomMap;

TEST(MapRestore, GivesBackWhatWasTakenApart) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    RandomMap random(seed);
    ASSERT_EQ(random.map().broken_invariants(), "");
  }
  RandomMap random(1);
  const Map& map = random.map();
  Map restored = Map::restore(take_apart(map));
  ASSERT_EQ(restored.broken_invariants(), "");
  EXPECT_EQ(restored.keyframes().end_id(), map.keyframes().end_id());
  EXPECT_EQ(restored.landmarks().end_id(), map.landmarks().end_id());
  map.landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
    EXPECT_EQ(restored.landmarks().at(id).observations, landmark.observations);
  });
  for (KeyframeId id{0}; id < map.keyframes().end_id(); ++id.value) {
    EXPECT_EQ(restored.resolve(id), map.resolve(id));
    const Rigid3 pose = map.rig_from_world(id, Rigid3(), 1.5);
    EXPECT_EQ(restored.rig_from_world(id, Rigid3(), 1.5).matrix(), pose.matrix());
  }
  for (LandmarkId id{0}; id < map.landmarks().end_id(); ++id.value) {
    EXPECT_EQ(restored.resolve(id), map.resolve(id));
  }
}

TEST(MapRestore, GoesOnWithIdsNeverGiven) {
  RandomMap random(2);
  const LandmarkId end = random.map().landmarks().end_id();
  Map map = Map::restore(take_apart(random.map()));
  const KeyframeId root = map.submaps()[0].root;
  const SubmapId submap = map.keyframes().at(root).submap;
  const LandmarkId first = map.add_landmark(submap, Eigen::Vector3d::Ones(), root);
  const LandmarkId second = map.add_landmark(submap, Eigen::Vector3d::Ones(), root);
  EXPECT_EQ(first, end);
  map.merge_landmarks(first, second);
  EXPECT_EQ(map.resolve(second), first);
  Keyframe keyframe = map.keyframes().at(root);
  keyframe.parent = root;
  EXPECT_EQ(map.add_keyframe(keyframe), random.map().keyframes().end_id());
  EXPECT_EQ(map.broken_invariants(), "");
}

struct Damage {
  std::string expected;
  std::function<void(MapParts&)> inflict;
};

/// The first keyframe that is no root.
Keyframe& follower(MapParts& parts) {
  for (auto& stored : parts.keyframes) {
    if (stored.keyframe.parent.is_valid()) return stored.keyframe;
  }
  return parts.keyframes.front().keyframe;
}

LandmarkId& association(Keyframe& keyframe) {
  for (LandmarkId& id : keyframe.landmarks) {
    if (id.is_valid()) return id;
  }
  return keyframe.landmarks.front();
}

std::vector<Damage> damages() {
  return {
      {"submap 1: is joined in a cycle",
       [](MapParts& parts) {
         parts.submaps.push_back({false, {}, SubmapId{1}});
         parts.submaps[1].joined_into = SubmapId{3};
       }},
      {"submap 1: is joined into one that is not there",
       [](MapParts& parts) { parts.submaps[1].joined_into = SubmapId{99}; }},
      {"submap 0: its root is gone",
       [](MapParts& parts) { parts.submaps[0].root = parts.end_keyframe; }},
      {"is a root with a parent or neither",
       [](MapParts& parts) { parts.submaps[0].root = KeyframeId{}; }},
      {"in a sub-map that is joined or not there",
       [](MapParts& parts) { follower(parts).submap = SubmapId{77}; }},
      {"its parent is gone", [](MapParts& parts) { follower(parts).parent = parts.end_keyframe; }},
      {"the spanning tree has a cycle above it",
       [](MapParts& parts) {
         for (auto& stored : parts.keyframes) {
           if (stored.keyframe.parent.is_valid()) stored.keyframe.parent = stored.id;
         }
       }},
      {"wrong number of landmarks", [](MapParts& parts) { follower(parts).landmarks.pop_back(); }},
      {"sees landmark 900000, which is not there",
       [](MapParts& parts) { association(follower(parts)) = LandmarkId{900000}; }},
      {"its position is not finite",
       [](MapParts& parts) { follower(parts).rig_from_world.translation.x() = std::nan(""); }},
      {"its reference does not see it",
       [](MapParts& parts) {
         for (auto& stored : parts.landmarks) stored.landmark.reference = KeyframeId{0};
       }},
      {"its reference was never there",
       [](MapParts& parts) { parts.landmarks[3].landmark.reference = parts.end_keyframe; }},
      {"loop_edge 0: ties a keyframe to itself",
       [](MapParts& parts) { parts.loop_edges[0].from = parts.loop_edges[0].to; }},
      {"loop_edge 0: one of its keyframes is gone",
       [](MapParts& parts) { parts.loop_edges[0].from = parts.erased_keyframes[0].id; }},
      {"is erased without an heir",
       [](MapParts& parts) { parts.erased_keyframes.erase(parts.erased_keyframes.begin()); }},
      {"its heirs go round in a cycle",
       [](MapParts& parts) {
         auto& erased = parts.erased_keyframes;
         erased[0].forwarding.heir = erased[1].id;
         erased[1].forwarding.heir = erased[0].id;
       }},
      {"its odometry was noted, though it was never there",
       [](MapParts& parts) { parts.odometry.back().id = parts.end_keyframe; }},
      {"its odometry is from a keyframe that was never there",
       [](MapParts& parts) { parts.odometry[0].node.parent = parts.end_keyframe; }},
      {"its odometry goes round in a cycle",
       [](MapParts& parts) { parts.odometry[1].node.parent = parts.odometry[1].id; }},
      {"was merged in a cycle",
       [](MapParts& parts) { parts.merged_landmarks[0].survivor = parts.merged_landmarks[0].id; }},
      {"was merged into one never there",
       [](MapParts& parts) { parts.merged_landmarks[0].survivor = parts.end_landmark; }},
  };
}

TEST(MapRestore, EveryDamageIsNamed) {
  for (const Damage& damage : damages()) {
    MapParts parts = take_apart(RandomMap(4).map());
    damage.inflict(parts);
    const Map map = Map::restore(std::move(parts));
    EXPECT_THAT(map.list_broken_invariants(1000), Contains(HasSubstr(damage.expected)));
  }
}

TEST(MapRestore, ListsAllDamages) {
  MapParts parts = take_apart(RandomMap(4).map());
  parts.loop_edges[0].from = parts.loop_edges[0].to;
  parts.merged_landmarks[0].survivor = parts.end_landmark;
  const Map map = Map::restore(std::move(parts));
  EXPECT_EQ(map.list_broken_invariants(1000).size(), 2u);
  EXPECT_EQ(map.list_broken_invariants(1).size(), 1u);
  EXPECT_EQ(map.broken_invariants(), map.list_broken_invariants(1).front());
}

}  // namespace
}  // namespace waymark

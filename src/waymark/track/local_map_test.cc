// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/local_map.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "waymark/match/testing/scene.h"

namespace waymark {
namespace {

/// Keyframes in a row. Each sees so many landmarks, and shares half of them with the next.
class Row {
 public:
  explicit Row(std::uint32_t num_keyframes) {
    auto features = std::make_shared<Features>();
    features->num_primary = kSeen;
    features->keypoints.resize(kSeen);
    features->descriptors.resize(kSeen);
    features->partner.assign(kSeen, kNoFeature);
    features->rig = make_test_rig(1);
    const SubmapId submap = map.add_submap(true);
    for (std::uint32_t k = 0; k < num_keyframes; ++k) {
      Keyframe keyframe;
      keyframe.submap = submap;
      if (k > 0) keyframe.parent = KeyframeId{k - 1};
      keyframe.features = features;
      const KeyframeId id = map.add_keyframe(std::move(keyframe));
      for (std::uint32_t i = 0; i < kSeen; ++i) {
        const std::uint32_t landmark = k * kSeen / 2 + i;
        while (map.landmarks().end_id().value <= landmark) {
          map.add_landmark(submap, Eigen::Vector3d::UnitZ(), id);
        }
        map.observe(id, i, LandmarkId{landmark});
      }
    }
  }

  /// All that a keyframe sees.
  std::vector<LandmarkId> seen_by(std::uint32_t keyframe) const {
    return map.keyframes().at(KeyframeId{keyframe}).landmarks;
  }

  static constexpr std::uint32_t kSeen = 20;
  Map map;
};

bool contains(const std::vector<KeyframeId>& ids, std::uint32_t id) {
  return std::find(ids.begin(), ids.end(), KeyframeId{id}) != ids.end();
}

TEST(LocalMap, ItsReferenceSharesMost) {
  const Row row(9);
  std::vector<LandmarkId> seen = row.seen_by(4);
  seen.resize(15);  // All that keyframe 3 shares with it, and half of what keyframe 5 does.
  LocalMap local;
  gather_local_map(row.map, seen, KeyframeId{0}, local);
  EXPECT_EQ(local.reference, KeyframeId{4});
  ASSERT_GE(local.keyframes.size(), 3u);
  EXPECT_EQ(local.keyframes[0], KeyframeId{4});
  EXPECT_EQ(local.keyframes[1], KeyframeId{3});
  EXPECT_EQ(local.keyframes[2], KeyframeId{5});
}

TEST(LocalMap, ReachesOneKeyframeFurtherThanWhatIsSeen) {
  const Row row(12);
  LocalMap local;
  gather_local_map(row.map, row.seen_by(6), KeyframeId{0}, local);
  for (const std::uint32_t id : {4u, 5u, 6u, 7u, 8u}) EXPECT_TRUE(contains(local.keyframes, id));
  for (const std::uint32_t id : {0u, 1u, 2u, 10u, 11u}) {
    EXPECT_FALSE(contains(local.keyframes, id)) << id;
  }
}

TEST(LocalMap, HoldsWhatItsKeyframesSeeOnceAndInOrder) {
  const Row row(12);
  LocalMap local;
  gather_local_map(row.map, row.seen_by(6), KeyframeId{0}, local);
  std::vector<LandmarkId> expected;
  for (const KeyframeId keyframe : local.keyframes) {
    const auto seen = row.seen_by(keyframe.value);
    expected.insert(expected.end(), seen.begin(), seen.end());
  }
  std::sort(expected.begin(), expected.end());
  expected.erase(std::unique(expected.begin(), expected.end()), expected.end());
  EXPECT_EQ(local.landmarks.ids, expected);
  EXPECT_EQ(local.landmarks.positions_in_world.size(), expected.size());
  // A second call starts afresh.
  gather_local_map(row.map, row.seen_by(0), KeyframeId{0}, local);
  EXPECT_EQ(local.reference, KeyframeId{0});
  EXPECT_FALSE(contains(local.keyframes, 6));
}

TEST(LocalMap, StaysSmallInABigMap) {
  std::vector<std::size_t> sizes;
  for (const std::uint32_t num_keyframes : {100u, 300u}) {
    const Row row(num_keyframes);
    std::vector<LandmarkId> everything;
    for (std::uint32_t k = 0; k < num_keyframes; ++k) {
      const auto seen = row.seen_by(k);
      everything.insert(everything.end(), seen.begin(), seen.end());
    }
    LocalMap local;
    gather_local_map(row.map, everything, KeyframeId{0}, local);
    sizes.push_back(local.keyframes.size());
  }
  EXPECT_EQ(sizes[0], sizes[1]);
  EXPECT_LT(sizes[0], 100u);
}

TEST(LocalMap, WithoutLandmarksIsThatOfTheFallbackOrItsHeir) {
  Row row(8);
  LocalMap local;
  gather_local_map(row.map, {}, KeyframeId{5}, local);
  EXPECT_EQ(local.reference, KeyframeId{5});
  row.map.erase_keyframe(KeyframeId{5});
  gather_local_map(row.map, {}, KeyframeId{5}, local);
  EXPECT_EQ(local.reference, row.map.resolve(KeyframeId{5}));
  EXPECT_FALSE(contains(local.keyframes, 5));
  EXPECT_FALSE(local.landmarks.ids.empty());
}

}  // namespace
}  // namespace waymark

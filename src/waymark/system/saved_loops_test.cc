// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Loops of a map that was saved and loaded again are weighed like those of a session.
#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "waymark/base/testing/temporary_folder.h"
#include "waymark/loop/global_mapper.h"
#include "waymark/loop/testing/loop.h"
#include "waymark/map/parts.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/simulate/testing/town_map.h"

namespace waymark {
namespace {

constexpr KeyframeId kQueryOfLie{60};

/// Two rounds, the loops of the second of which are open.
class SavedLoopsTest : public ::testing::Test {
 protected:
  SavedLoopsTest() {
    scene_.rig = make_town_rig(1);  // That map files can hold.
    for (int step = 0; step < 2 * kRound; ++step) scene_.add_keyframe(step);
  }

  /// What the query says of the match if it sees what was seen from a third.
  LoopCandidate candidate(int query, int match, int seen_from) const {
    LoopCandidate candidate;
    candidate.query = KeyframeId{static_cast<std::uint32_t>(query)};
    candidate.match = KeyframeId{static_cast<std::uint32_t>(match)};
    candidate.query_from_match = scene_.true_motion(query, seen_from);
    return candidate;
  }

  GlobalMapper mapper_of(const MapSnapshot& snapshot) const {
    GlobalMapper mapper(scene_.rig, {}, {}, {.refine = "off"}, 1);
    mapper.take_over(snapshot);
    return mapper;
  }

  /// Closes a false loop and saves what comes of it.
  StoredMap with_lie_saved_and_loaded() {
    GlobalMapper mapper = mapper_of(index_map(scene_.map.freeze()));
    EXPECT_TRUE(mapper.close(candidate(60, 5, 59))) << "nothing contradicts the first";
    const testing::TemporaryFolder folder;
    StoredMap stored;
    stored.map = mapper.snapshot().map;
    save_map(folder / "map.wmap", stored);
    return load_map(folder / "map.wmap");
  }

  /// Goes on with a map and closes true loops.
  std::shared_ptr<const Map> extended(std::shared_ptr<const Map> map) const {
    GlobalMapper mapper = mapper_of(index_map(std::move(map)));
    for (const auto& [query, match] : {std::pair(44, 4), {52, 12}, {78, 38}, {66, 26}}) {
      mapper.close(candidate(query, match, match));
    }
    return mapper.snapshot().map;
  }

  double error_of(const Map& map) const {
    double worst = 0.0;
    map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
      const Rigid3 truth = LoopScene::true_pose(scene_.steps[id.value]).inverse();
      worst = std::max(worst, (keyframe.rig_from_world * truth.inverse()).translation.norm());
    });
    return worst;
  }

  LoopScene scene_{cloud_all_round(4000), true, drift_of(0.3, 0.05, 0.0)};
};

TEST_F(SavedLoopsTest, AFalseOneIsUndoneOnceOthersContradictIt) {
  const double error_open = error_of(scene_.map);
  const StoredMap stored = with_lie_saved_and_loaded();
  ASSERT_TRUE(stored.map->has_loop_edge(kQueryOfLie));
  ASSERT_GT(error_of(*stored.map), 5.0 * error_open);
  const auto map = extended(stored.map);
  EXPECT_FALSE(map->has_loop_edge(kQueryOfLie));
  EXPECT_GE(map->loop_edges().size(), 3u);
  EXPECT_LT(error_of(*map), error_open);
  EXPECT_EQ(map->broken_invariants(), "");
}

TEST_F(SavedLoopsTest, ThatOfAMapWithoutOdometryIsTakenForWhatWasSeenOnTheWay) {
  MapParts parts = take_apart(*with_lie_saved_and_loaded().map);
  ASSERT_EQ(parts.odometry.size(), parts.keyframes.size());
  parts.odometry.clear();  // As earlier versions wrote it.
  const auto map = extended(Map::restore(std::move(parts)).freeze());
  EXPECT_TRUE(map->has_loop_edge(kQueryOfLie));
  EXPECT_EQ(map->broken_invariants(), "");
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/loop_pose_graph.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "waymark/simulate/testing/town_map.h"

namespace waymark {
namespace {

/// A closed town and its last loop candidate, whose loop is not in it.
class LoopPoseGraphTest : public ::testing::Test {
 protected:
  /// The candidate as the map has it, off by a distance.
  LoopEdge loop_off_by(double distance_m) const {
    LoopEdge loop = town_.revisits.back();
    loop.to_from_from = Sim3(rig_from_world(loop.to) * rig_from_world(loop.from).inverse());
    loop.to_from_from.translation.x() += distance_m;
    return loop;
  }

  const Rigid3& rig_from_world(KeyframeId id) const {
    return town_.map->keyframes().at(id).rig_from_world;
  }

  static double residual(const Map& map, const LoopEdge& loop) {
    const Sim3 mapped(map.keyframes().at(loop.to).rig_from_world *
                      map.keyframes().at(loop.from).rig_from_world.inverse());
    return (mapped * loop.to_from_from.inverse()).translation.norm();
  }

  /// The longest change of a step of the spanning tree, in metres.
  double longest_change(const Map& moved) const {
    double longest = 0.0;
    town_.map->keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
      if (!keyframe.parent.is_valid()) return;
      const Rigid3 before = keyframe.rig_from_world * rig_from_world(keyframe.parent).inverse();
      const Rigid3 now = moved.keyframes().at(id).rig_from_world *
                         moved.keyframes().at(keyframe.parent).rig_from_world.inverse();
      longest = std::max(longest, (now * before.inverse()).translation.norm());
    });
    return longest;
  }

  const TownMap town_ = make_town_map({.num_keyframes = 1200});
};

TEST_F(LoopPoseGraphTest, MovesWhatLiesAroundTheEndsWhereTheDriftIsSmall) {
  const LoopEdge loop = loop_off_by(0.02);
  const LoopPoseGraph spread = optimize_loop(*town_.map, loop);
  ASSERT_TRUE(spread.correction.is_of_part);
  EXPECT_LT(spread.correction.keyframes.size(), town_.map->keyframes().size() / 2);
  Map map = Map::thaw(*town_.map);
  apply_correction(map, spread.correction);
  EXPECT_EQ(map.broken_invariants(), "");
  EXPECT_LT(residual(map, loop), 0.3 * residual(*town_.map, loop));
  EXPECT_LT(longest_change(map), 0.02) << "nothing is torn, at the rim neither";
}

TEST_F(LoopPoseGraphTest, TakesAllOfTheMapWhereTheDriftIsLarge) {
  const LoopPoseGraph spread = optimize_loop(*town_.map, loop_off_by(30.0));
  EXPECT_FALSE(spread.correction.is_of_part);
  EXPECT_EQ(spread.correction.keyframes.size(), town_.map->keyframes().size());
}

TEST_F(LoopPoseGraphTest, TellsByHowMuchALoopContradictsTheMap) {
  const double at_rest = optimize_loop(*town_.map, loop_off_by(0.0)).chi_squared;
  const double off = optimize_loop(*town_.map, loop_off_by(0.02)).chi_squared;
  const double twice_as_far_off = optimize_loop(*town_.map, loop_off_by(0.04)).chi_squared;
  EXPECT_LT(at_rest, 1e-6);
  EXPECT_GT(off, 1e-3);
  EXPECT_GT(twice_as_far_off, 2.0 * off);
}

}  // namespace
}  // namespace waymark

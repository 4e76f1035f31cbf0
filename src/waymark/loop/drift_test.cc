// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/drift.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "waymark/loop/testing/loop.h"

namespace waymark {
namespace {

TEST(DriftTest, ShortestWayGoesAlongTheGraph) {
  LoopScene scene(cloud_all_round(kNumPoints), false, Vector7d::Zero());
  for (int step = 0; step < kRound / 2; ++step) scene.add_keyframe(step);
  const auto way = shortest_way(scene.map, KeyframeId{kRound / 2 - 1}, KeyframeId{0});
  ASSERT_TRUE(way);
  // Between the chord and the arc of nearly half a round.
  EXPECT_GT(way->length, 2.2 * LoopScene::kRadius);
  EXPECT_LT(way->length, std::numbers::pi * LoopScene::kRadius);
  EXPECT_LT(way->num_steps, kRound / 2 - 1);
  scene.start_submap(Sim3());
  const KeyframeId elsewhere = scene.add_keyframe(0);
  EXPECT_FALSE(shortest_way(scene.map, elsewhere, KeyframeId{0}));
}

TEST(DriftTest, ImpliedDriftIsTheDrift) {
  LoopScene scene(cloud_all_round(kNumPoints), false, drift_of(0.0, 0.1, 0.2));
  for (int step = 0; step <= kRound; ++step) scene.add_keyframe(step);
  LoopCandidate candidate;
  candidate.query = KeyframeId{kRound};
  candidate.match = KeyframeId{0};
  candidate.query_from_match = scene.true_motion(kRound, 0);
  const ImpliedDrift drift = implied_drift(scene.map, candidate);
  EXPECT_NEAR(drift.angle_rad, 0.1, 1e-9);
  EXPECT_NEAR(std::abs(drift.log_scale), 0.2, 1e-9);
  EXPECT_TRUE(is_plausible_loop(scene.map, candidate));
}

TEST(DriftTest, IsPlausibleForItsWayOnly) {
  LoopScene scene(cloud_all_round(kNumPoints), true, Vector7d::Zero());
  for (int step = 0; step <= kRound; ++step) scene.add_keyframe(step);
  LoopCandidate candidate;
  candidate.query = KeyframeId{kRound};
  candidate.match = KeyframeId{0};
  const double way = shortest_way(scene.map, candidate.query, candidate.match)->length;
  candidate.query_from_match.translation = {0.03 * way, 0.0, 0.0};
  EXPECT_TRUE(is_plausible_loop(scene.map, candidate));
  candidate.query_from_match.translation = {0.08 * way, 0.0, 0.0};
  EXPECT_FALSE(is_plausible_loop(scene.map, candidate));
  candidate.match = KeyframeId{kRound - 1};  // A step of 0.6 does not allow what the round does.
  candidate.query_from_match =
      Sim3(LoopScene::true_pose(kRound).inverse() * LoopScene::true_pose(kRound - 1));
  EXPECT_TRUE(is_plausible_loop(scene.map, candidate));
  candidate.query_from_match.translation.x() += 0.03 * way;
  EXPECT_FALSE(is_plausible_loop(scene.map, candidate));
}

/// Rounds whose last keyframe sees the place of another again.
class TurnedLoopTest : public ::testing::Test {
 protected:
  TurnedLoopTest() {
    for (int step = 0; step <= kNumRounds * kRound; ++step) scene_.add_keyframe(step);
  }

  /// As the map has it, but turned and grown by so much.
  LoopCandidate off_by(KeyframeId match, double angle_rad, double log_scale) const {
    LoopCandidate candidate;
    candidate.query = KeyframeId{kNumRounds * kRound};
    candidate.match = match;
    const auto& keyframes = scene_.map.keyframes();
    candidate.query_from_match = Sim3::exp(drift_of(0.0, angle_rad, log_scale)) *
                                 Sim3(keyframes.at(candidate.query).rig_from_world *
                                      keyframes.at(match).rig_from_world.inverse());
    return candidate;
  }

  /// A keyframe from which the way to the last has about so many steps.
  KeyframeId before(int num_steps) const {
    KeyframeId id{kNumRounds * kRound};
    while (shortest_way(scene_.map, KeyframeId{kNumRounds * kRound}, id)->num_steps < num_steps) {
      --id.value;
    }
    return id;
  }

  bool is_plausible(const LoopCandidate& candidate) const {
    return is_plausible_loop(scene_.map, candidate);
  }

  static constexpr int kNumRounds = 12;
  LoopScene scene_{cloud_all_round(1000), false, Vector7d::Zero()};
};

TEST_F(TurnedLoopTest, WhatIsPossibleGrowsWithTheWay) {
  EXPECT_TRUE(is_plausible(off_by(before(150), 0.8, 0.0)));
  EXPECT_FALSE(is_plausible(off_by(before(100), 0.8, 0.0)));
  EXPECT_FALSE(is_plausible(off_by(before(150), 1.2, 0.0)));
  EXPECT_TRUE(is_plausible(off_by(before(30), 0.3, 0.0)));
  EXPECT_FALSE(is_plausible(off_by(before(20), 0.3, 0.0)));
  EXPECT_TRUE(is_plausible(off_by(before(100), 0.0, 1.4)));
  EXPECT_FALSE(is_plausible(off_by(before(40), 0.0, 1.4)));
}

TEST_F(TurnedLoopTest, AWayThatIsEnoughIsTheWayOrNotLonger) {
  const KeyframeId last{kNumRounds * kRound};
  int num_cut = 0;
  for (const int num_steps : {5, 40, 120}) {
    const KeyframeId match = before(num_steps);
    const GraphWay way = *shortest_way(scene_.map, last, match);
    for (const double length : {0.0, 0.5 * way.length, 2.0 * way.length}) {
      for (const int steps : {0, way.num_steps / 2, way.num_steps, way.num_steps + 1}) {
        const GraphWay found = *shortest_way(scene_.map, last, match, GraphWay{length, steps});
        const bool is_enough = way.length >= length && way.num_steps >= steps;
        EXPECT_EQ(found.length >= length && found.num_steps >= steps, is_enough);
        const bool is_cut = found.length != way.length;
        EXPECT_TRUE(!is_cut || (found.length == length && found.num_steps == steps));
        num_cut += is_cut;
      }
    }
  }
  EXPECT_GE(num_cut, 9) << "it ends where that is enough";
}

}  // namespace
}  // namespace waymark

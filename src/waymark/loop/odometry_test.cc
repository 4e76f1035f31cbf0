// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/odometry.h"

#include <gtest/gtest.h>

#include "waymark/loop/close.h"
#include "waymark/loop/loop_pose_graph.h"
#include "waymark/loop/testing/loop.h"

namespace waymark {
namespace {

constexpr SubmapId kSubmap{0};

/// Three rounds that drift, and what the images say of places seen again.
class OdometryTest : public ::testing::TestWithParam<bool> {
 protected:
  OdometryTest() {
    for (int step = 0; step < 3 * kRound; ++step) scene_.add_keyframe(step);
    note_odometry(scene_.map);
  }

  LoopEdge true_loop(int from, int to) const {
    return {id(from), id(to), scene_.true_motion(to, from)};
  }
  /// As if the keyframe before `to` were `from`.
  LoopEdge false_loop(int from, int to) const {
    return {id(from), id(to), scene_.true_motion(to, to - 1)};
  }
  static KeyframeId id(int step) { return KeyframeId{static_cast<std::uint32_t>(step)}; }

  std::vector<std::uint8_t> choose(const std::vector<LoopEdge>& loops) const {
    return choose_loops(scene_.map, kSubmap, loops, loops.size() - 1);
  }

  LoopScene scene_{cloud_all_round(1000), GetParam(), drift_of(0.2, 0.05, GetParam() ? 0.0 : 0.05)};
};

TEST_P(OdometryTest, TellsAFalseLoopByTheOthers) {
  const std::vector<LoopEdge> loops = {true_loop(2, 42),
                                       true_loop(10, 52),
                                       true_loop(60, 100),
                                       false_loop(30, 84),
                                       true_loop(35, 117)};
  EXPECT_EQ(choose(loops), (std::vector<std::uint8_t>{1, 1, 1, 0, 1}));
}

TEST_P(OdometryTest, StillTellsItOnceTheMapIsBent) {
  const LoopEdge lie = false_loop(30, 84);
  apply_correction(scene_.map, optimize_loop(scene_.map, lie).correction);
  scene_.map.add_loop_edge({lie.from, lie.to, lie.to_from_from});
  const double error_bent = error_of(scene_);
  note_odometry(scene_.map);
  std::vector<LoopEdge> loops = {
      lie, true_loop(2, 42), true_loop(10, 52), true_loop(60, 100), true_loop(35, 117)};
  EXPECT_EQ(choose(loops), (std::vector<std::uint8_t>{0, 1, 1, 1, 1}));
  loops.erase(loops.begin());
  apply_correction(scene_.map, place_by_odometry(scene_.map, kSubmap, loops));
  EXPECT_LT(error_of(scene_), 0.1);
  EXPECT_LT(error_of(scene_), 0.2 * error_bent);
  EXPECT_EQ(scene_.map.broken_invariants(), "");
}

TEST_P(OdometryTest, WithoutLoopsKeyframesGoBackToWhereTheyWere) {
  std::vector<Rigid3> before;
  scene_.map.keyframes().for_each(
      [&](KeyframeId, const Keyframe& keyframe) { before.push_back(keyframe.rig_from_world); });
  apply_correction(scene_.map, optimize_loop(scene_.map, false_loop(30, 84)).correction);
  apply_correction(scene_.map, place_by_odometry(scene_.map, kSubmap, {}));
  for (std::uint32_t i = 0; i < before.size(); ++i) {
    const Keyframe& keyframe = scene_.map.keyframes().at(KeyframeId{i});
    EXPECT_TRUE(keyframe.rig_from_world.matrix().isApprox(before[i].matrix(), 1e-6)) << i;
    EXPECT_NEAR(keyframe.applied_scale, 1.0, 1e-6);
  }
}

TEST_P(OdometryTest, RemembersWhatWasErased) {
  for (const int step : {20, 21, 22, 50, 70}) scene_.map.erase_keyframe(id(step));
  const std::vector<LoopEdge> loops = {
      true_loop(2, 42), true_loop(10, 52), false_loop(30, 84), true_loop(60, 100)};
  EXPECT_EQ(choose(loops), (std::vector<std::uint8_t>{1, 1, 0, 1}));
  const MapCorrection correction = place_by_odometry(scene_.map, kSubmap, {});
  EXPECT_EQ(correction.keyframes.size(), scene_.map.keyframes().size());
}

INSTANTIATE_TEST_SUITE_P(ScaleFreeOrMetric, OdometryTest, ::testing::Bool());

}  // namespace
}  // namespace waymark

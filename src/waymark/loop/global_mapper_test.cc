// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/global_mapper.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "waymark/loop/testing/loop.h"

namespace waymark {
namespace {

/// A metric map with drift, one sub-map for each [first, end) of steps.
LoopScene walk(const std::vector<std::pair<int, int>>& parts) {
  LoopScene scene(cloud_all_round(4000), true, drift_of(0.3, 0.05, 0.0));
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (i > 0) scene.start_submap(Sim3({1.0, 0.0, 0.0, 0.0}, {3.0, 1.0, -2.0}, 1.0));
    for (int step = parts[i].first; step < parts[i].second; ++step) scene.add_keyframe(step);
  }
  return scene;
}

MapSnapshot snapshot_of(LoopScene& scene) {
  return {scene.map.freeze(), std::make_shared<const PlaceIndex>(scene.places)};
}

/// The last keyframe of a scene as the tracker would have sent it.
NewKeyframe last_of(const LoopScene& scene) {
  const Map& map = scene.map;
  const Keyframe& last = map.keyframes().at(KeyframeId{map.keyframes().end_id().value - 1});
  NewKeyframe message;
  message.frame = last.frame;
  message.features = last.features;
  message.landmarks = last.landmarks;
  for (LandmarkId& id : message.landmarks) {
    if (id.is_valid() && num_observers(map.landmarks().at(id)) < 2) id = {};  // New with it.
  }
  message.pose.reference = last.parent;
  message.pose.rig_from_reference =
      last.rig_from_world * map.keyframes().at(last.parent).rig_from_world.inverse();
  return message;
}

std::vector<Rigid3> poses_of(const Map& map) {
  std::vector<Rigid3> poses;
  map.keyframes().for_each(
      [&](KeyframeId, const Keyframe& keyframe) { poses.push_back(keyframe.rig_from_world); });
  return poses;
}

bool are_same(const std::vector<Rigid3>& a, const std::vector<Rigid3>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Rigid3& x, const Rigid3& y) {
    return x.matrix() == y.matrix();
  });
}

/// How far the end of the walk is from where it would be without drift.
double error_at_the_end(const Map& map, KeyframeId last) {
  const Rigid3 truth = LoopScene::true_pose(kRound).inverse();
  return (map.keyframes().at(last).rig_from_world * truth.inverse()).translation.norm();
}

class GlobalMapperTest : public ::testing::Test {
 protected:
  /// Goes on with a round that is all but closed.
  void take_over_round(bool is_enabled = true) {
    round_ = walk({{0, kRound}});
    mapper_.emplace(
        round_.rig, MappingSettings{}, LoopSettings{is_enabled}, CalibrationSettings{}, 1);
    mapper_->take_over(snapshot_of(round_));
  }

  LoopScene round_ = walk({});
  std::optional<GlobalMapper> mapper_;
};

TEST_F(GlobalMapperTest, GoesOnInAMapMadeBeforeAndClosesItsLoop) {
  take_over_round();
  EXPECT_EQ(mapper_->map().keyframes().size(), static_cast<std::size_t>(kRound));
  mapper_->add(last_of(walk({{0, kRound + 1}})));
  EXPECT_EQ(mapper_->num_loops(), 1);
  EXPECT_EQ(mapper_->map().broken_invariants(), "");
  const LoopEdge loop = mapper_->map().loop_edges().at(0);
  EXPECT_EQ(loop.to, KeyframeId{kRound});
  EXPECT_LT(loop.from.value, 6u);
  EXPECT_LT(error_at_the_end(mapper_->map(), loop.to), 0.05) << "of 0.13 where it stays open";
  // What it hands on has the keyframe, too.
  const MapSnapshot snapshot = mapper_->snapshot();
  EXPECT_TRUE(snapshot.places->contains(KeyframeId{kRound}));
  GlobalMapper next(round_.rig, {}, {}, {}, 1);
  next.take_over(snapshot);
  EXPECT_TRUE(are_same(poses_of(next.map()), poses_of(mapper_->map())));
  EXPECT_FALSE(next.take_task()) << "tasks stay with those whose loops they follow";
}

TEST_F(GlobalMapperTest, HandsOutEachAdjustmentOnceAndTakesItIn) {
  take_over_round();
  EXPECT_FALSE(mapper_->take_task());
  mapper_->add(last_of(walk({{0, kRound + 1}})));
  const std::optional<AdjustmentTask> task = mapper_->take_task();
  ASSERT_TRUE(task);
  EXPECT_EQ(task->submap, SubmapId{0});
  EXPECT_EQ(task->num_closures, 1u);
  EXPECT_TRUE(are_same(poses_of(*task->map), poses_of(mapper_->map())));
  EXPECT_FALSE(mapper_->take_task());
  const double error_before = error_at_the_end(mapper_->map(), KeyframeId{kRound});
  mapper_->apply(*task, adjust_globally(*task->map, task->submap));
  EXPECT_EQ(mapper_->map().broken_invariants(), "");
  EXPECT_FALSE(are_same(poses_of(*task->map), poses_of(mapper_->map())));
  EXPECT_LT(error_at_the_end(mapper_->map(), KeyframeId{kRound}), error_before);
}

TEST_F(GlobalMapperTest, CarriesAnAdjustmentOverIfSomethingWasClosedMeanwhile) {
  LoopScene both = walk({{0, kRound}, {10, 16}});
  GlobalMapper mapper(both.rig, {}, {}, {}, 1);
  mapper.take_over(snapshot_of(both));
  NewKeyframe of_first = last_of(walk({{0, kRound + 1}}));
  mapper.add(of_first);
  const std::optional<AdjustmentTask> task = mapper.take_task();
  ASSERT_TRUE(task);
  const GlobalAdjustment adjustment = adjust_globally(*task->map, task->submap);
  mapper.add(last_of(walk({{0, kRound}, {10, 17}})));
  ASSERT_EQ(mapper.map().resolve(SubmapId{1}), SubmapId{0}) << "joined meanwhile";
  const std::vector<Rigid3> poses = poses_of(mapper.map());
  mapper.apply(*task, adjustment);
  // The join moved nothing of the sub-map that was adjusted.
  for (const auto& move : adjustment.correction.keyframes) {
    const Rigid3 off =
        mapper.map().keyframes().at(move.keyframe).rig_from_world * move.rig_from_world.inverse();
    EXPECT_LT(off.log().norm(), 1e-9);
  }
  const std::vector<Rigid3> carried = poses_of(mapper.map());
  EXPECT_FALSE(are_same(carried, poses));
  const std::optional<AdjustmentTask> next = mapper.take_task();
  ASSERT_TRUE(next) << "for what was closed meanwhile";
  EXPECT_EQ(next->num_closures, 2u);
  mapper.apply(*next, adjust_globally(*next->map, next->submap));
  EXPECT_FALSE(are_same(poses_of(mapper.map()), poses));
  EXPECT_EQ(mapper.map().broken_invariants(), "");
}

TEST_F(GlobalMapperTest, PutsAPartElsewhereAndDropsWhatWasAdjustedBefore) {
  take_over_round();
  mapper_->add(last_of(walk({{0, kRound + 1}})));
  const std::optional<AdjustmentTask> task = mapper_->take_task();
  ASSERT_TRUE(task);
  const std::vector<Rigid3> before = poses_of(mapper_->map());
  const Sim3 new_from_old(so3_exp({0.3, -1.0, 0.2}), {1.0, 2.0, 3.0}, 2.5);
  mapper_->place({SubmapId{0}, new_from_old});
  mapper_->apply(*task, adjust_globally(*task->map, task->submap));
  const std::vector<Rigid3> after = poses_of(mapper_->map());
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Eigen::Vector3d moved = new_from_old * before[i].origin_in_source();
    EXPECT_LT((after[i].origin_in_source() - moved).norm(), 1e-6) << i;
  }
  EXPECT_EQ(mapper_->placement()->submap, SubmapId{0});
  EXPECT_TRUE(mapper_->take_task());  // Of the part as it is now.
}

TEST_F(GlobalMapperTest, ConsolidatesAtTheEnd) {
  // The way goes on beside its beginning. Closed at its last keyframe, it hangs loose elsewhere.
  LoopScene scene = walk({{0, kRound + 8}});
  GlobalMapper mapper(scene.rig, {}, {}, {}, 1);
  mapper.take_over(snapshot_of(scene));
  mapper.finish();
  EXPECT_GE(mapper.num_loops(), 1);
  EXPECT_EQ(mapper.map().broken_invariants(), "");
  EXPECT_LT(error_at_the_end(mapper.map(), KeyframeId{kRound}), 0.02);
  EXPECT_LT(mapper.map().landmarks().size(), scene.map.landmarks().size() - 100);
  std::size_t num_known = 0;  // Keyframes of the second round that know those of the first.
  for (std::uint32_t i = kRound; i < kRound + 8; ++i) {
    if (!mapper.map().keyframes().contains(KeyframeId{i})) continue;
    num_known += mapper.map().covisible(KeyframeId{i}).front().keyframe.value < 10;
  }
  EXPECT_GE(num_known, 7u);
}

TEST_F(GlobalMapperTest, UndoesAFalseLoopOnceOthersContradictIt) {
  LoopScene scene = walk({{0, 2 * kRound}});
  GlobalMapper mapper(scene.rig, {}, {}, {.refine = "off"}, 1);
  mapper.take_over(snapshot_of(scene));
  const auto candidate = [&](int query, int match, int seen_from) {
    LoopCandidate candidate;
    candidate.query = KeyframeId{static_cast<std::uint32_t>(query)};
    candidate.match = KeyframeId{static_cast<std::uint32_t>(match)};
    candidate.query_from_match = scene.true_motion(query, seen_from);
    return candidate;
  };
  const auto error = [&] {
    double worst = 0.0;
    mapper.map().keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
      const Rigid3 truth = LoopScene::true_pose(scene.steps[id.value]).inverse();
      worst = std::max(worst, (keyframe.rig_from_world * truth.inverse()).translation.norm());
    });
    return worst;
  };
  const double error_open = error();
  // Nothing contradicts the first, nor tells it from a second that does.
  EXPECT_TRUE(mapper.close(candidate(60, 5, 59)));
  ASSERT_GT(error(), 5.0 * error_open);
  std::optional<AdjustmentTask> task = mapper.take_task();
  int num_closed = 0;
  for (const auto& [query, match] : {std::pair(44, 4), {52, 12}, {78, 38}, {66, 26}}) {
    num_closed += mapper.close(candidate(query, match, match));
  }
  EXPECT_GE(num_closed, 3);
  EXPECT_EQ(mapper.num_loops(), num_closed);
  EXPECT_EQ(mapper.map().loop_edges().size(), static_cast<std::size_t>(num_closed));
  EXPECT_LT(error(), error_open);
  EXPECT_EQ(mapper.map().broken_invariants(), "");
  // The same again is not believed, and what was adjusted with it in place is not taken in.
  EXPECT_FALSE(mapper.close(candidate(62, 7, 61)));
  mapper.apply(*task, adjust_globally(*task->map, task->submap));
  EXPECT_LT(error(), error_open);
  mapper.finish();
  EXPECT_LT(error(), error_open);
  EXPECT_EQ(mapper.map().broken_invariants(), "");
}

TEST_F(GlobalMapperTest, FreesAMapItselfOnceNobodyLooksAtIt) {
  take_over_round();
  MapSnapshot looked_at = mapper_->snapshot();
  const std::weak_ptr<const Map> map = looked_at.map;
  mapper_->snapshot();
  looked_at = mapper_->snapshot();
  EXPECT_FALSE(map.expired()) << "freed by who looked at it";
  mapper_->snapshot();
  EXPECT_TRUE(map.expired());
}

TEST_F(GlobalMapperTest, LeavesLoopsOpenIfAskedTo) {
  take_over_round(false);
  mapper_->add(last_of(walk({{0, kRound + 1}})));
  mapper_->finish();
  EXPECT_EQ(mapper_->num_loops(), 0);
  EXPECT_TRUE(mapper_->map().loop_edges().empty());
  EXPECT_FALSE(mapper_->take_task());
  EXPECT_GT(error_at_the_end(mapper_->map(), KeyframeId{kRound}), 0.1);
}

TEST_F(GlobalMapperTest, FinishesWithoutAnything) {
  GlobalMapper mapper(round_.rig, {}, {}, {}, 1);
  mapper.finish();
  EXPECT_TRUE(mapper.map().submaps().empty());
}

}  // namespace
}  // namespace waymark

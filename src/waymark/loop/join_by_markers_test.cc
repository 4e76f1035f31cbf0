// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/join_by_markers.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "waymark/geometry/alignment.h"
#include "waymark/loop/merge_maps.h"
#include "waymark/loop/testing/loop.h"
#include "waymark/map/parts.h"

namespace waymark {
namespace {

constexpr double kSideM = 0.2;

struct HungMarker {
  int id;
  Rigid3 world_from_marker;
};

const HungMarker kFirst = {3, Rigid3::exp((Vector6d() << 1, 2, 3, 0.3, -0.5, 0.2).finished())};
const HungMarker kSecond = {7, Rigid3::exp((Vector6d() << -2, 1, 2, -0.3, 0.4, 1.2).finished())};
const HungMarker kThird = {9, Rigid3::exp((Vector6d() << 2, 0, -2, 1.3, 0.4, -0.2).finished())};

HungMarker moved(HungMarker marker) {
  marker.world_from_marker.translation.x() += 0.7;
  return marker;
}

/// A map in metres of the steps from one to another, in a frame of its own, that knows markers.
std::unique_ptr<LoopScene> walk(int from_step,
                                int to_step,
                                const Rigid3& map_from_world,
                                const std::vector<HungMarker>& hung) {
  auto scene = std::make_unique<LoopScene>(cloud_all_round(300), true, Vector7d::Zero());
  scene->map = Map();
  scene->start_submap(Sim3(map_from_world));
  for (int step = from_step; step < to_step; ++step) scene->add_keyframe(step);
  std::vector<MapMarker> markers;
  for (const HungMarker& one : hung) {
    MapMarker marker;
    marker.id = one.id;
    marker.side_m = kSideM;
    marker.reference = KeyframeId{1};
    const Rigid3 rig_from_world = scene->map.keyframes().at(KeyframeId{1}).rig_from_world;
    marker.marker_from_reference =
        one.world_from_marker.inverse() * map_from_world.inverse() * rig_from_world.inverse();
    markers.push_back(marker);
  }
  scene->map.set_markers(markers);
  return scene;
}

const Rigid3 kFrameOfA;
const Rigid3 kFrameOfB = Rigid3::exp((Vector6d() << 4, -1, 2, 0.2, 1.1, -0.4).finished());

double largest_error_of(const Map& map, const LoopScene& a, const LoopScene& b) {
  double most = 0.0;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    const std::size_t index = id.value;
    const int step = index < a.steps.size() ? a.steps[index] : b.steps[index - a.steps.size()];
    const Eigen::Vector3d truth = LoopScene::true_pose(step).translation;
    most = std::max(most, (keyframe.rig_from_world.origin_in_source() - truth).norm());
  });
  return most;
}

/// Both in one and joined, nothing adjusted.
Map join_maps(const Map& a, const Map& b) {
  Map both = unite(a, b);
  PlaceIndex places;
  EXPECT_EQ(join_by_markers(both, places), 1);
  EXPECT_EQ(both.broken_invariants(), "");
  return both;
}

TEST(JoinByMarkersTest, MapsThatShareNothingButAMarkerBecomeOne) {
  const auto a = walk(0, 8, kFrameOfA, {kFirst});
  const auto b = walk(20, 28, kFrameOfB, {kFirst, kSecond});
  const MergedMaps merged = merge_maps(a->map, b->map, 1);
  ASSERT_EQ(merged.map->broken_invariants(), "");
  EXPECT_EQ(merged.num_joins, 1);
  EXPECT_EQ(merged.num_loops, 0);
  EXPECT_EQ(merged.map->submaps()[1].joined_into, SubmapId{0});
  const Map joined = join_maps(a->map, b->map);
  EXPECT_LT(largest_error_of(joined, *a, *b), 1e-6);
  ASSERT_EQ(joined.markers().size(), 2u);  // Each once.
  for (const MapMarker& marker : joined.markers()) {
    const HungMarker& hung = marker.id == kFirst.id ? kFirst : kSecond;
    const Rigid3 found = joined.world_from_marker(marker);
    EXPECT_LT((found.translation - hung.world_from_marker.translation).norm(), 1e-6) << marker.id;
  }
}

TEST(JoinByMarkersTest, TheOneOfThreeThatWasMovedBetweenTheRecordingsDoesNoHarm) {
  const auto a = walk(0, 8, kFrameOfA, {kFirst, kSecond, kThird});
  const auto b = walk(20, 28, kFrameOfB, {moved(kFirst), kSecond, kThird});
  const Map joined = join_maps(a->map, b->map);
  EXPECT_LT(largest_error_of(joined, *a, *b), 1e-6);
  for (const MapMarker& marker : joined.markers()) EXPECT_NE(marker.id, kFirst.id);
}

/// Or places seen again could not contradict the markers.
TEST(JoinByMarkersTest, OdometryIsThatOfThePartsBeforeTheyWereJoined) {
  const auto a = walk(0, 8, kFrameOfA, {kFirst});
  const auto b = walk(20, 28, kFrameOfB, {kFirst});
  const Map joined = join_maps(a->map, b->map);
  EXPECT_EQ(joined.measured_loop_edges().size(), 1u);
  b->map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    const KeyframeId now{id.value + a->map.keyframes().end_id().value};
    ASSERT_TRUE(joined.odometry().contains(now));
    const KeyframeId parent = joined.odometry().at(now).parent;
    EXPECT_EQ(parent.is_valid(), keyframe.parent.is_valid());
    if (!parent.is_valid()) return;
    EXPECT_EQ(parent.value - now.value, keyframe.parent.value - id.value);
  });
}

TEST(JoinByMarkersTest, MarkersThatContradictEachOtherJoinNothing) {
  const auto a = walk(0, 8, kFrameOfA, {kFirst, kSecond});
  const auto b = walk(20, 28, kFrameOfB, {moved(kFirst), kSecond});
  EXPECT_EQ(merge_maps(a->map, b->map, 1).num_joins, 0);
}

TEST(JoinByMarkersTest, OtherNumbersAndOtherSizesAreOtherMarkers) {
  const auto a = walk(0, 8, kFrameOfA, {kFirst});
  const auto other = walk(20, 28, kFrameOfB, {kSecond});
  EXPECT_EQ(merge_maps(a->map, other->map, 1).num_joins, 0);
  const auto larger = walk(20, 28, kFrameOfB, {kFirst});
  std::vector<MapMarker> markers = larger->map.markers();
  markers[0].side_m = 0.3;
  larger->map.set_markers(markers);
  EXPECT_EQ(merge_maps(a->map, larger->map, 1).num_joins, 0);
}

TEST(JoinByMarkersTest, WhatWasSurveyedInAnotherFrameHoldsNothing) {
  const auto a = walk(0, 8, kFrameOfA, {kFirst});
  const auto b = walk(20, 28, kFrameOfB, {kFirst, kSecond});
  std::vector<MapMarker> markers = b->map.markers();
  for (MapMarker& marker : markers) {
    marker.surveyed_world_from_marker = b->map.world_from_marker(marker);
  }
  b->map.set_markers(markers);
  const Map joined = join_maps(a->map, b->map);
  EXPECT_LT(largest_error_of(joined, *a, *b), 1e-6);
  for (const MapMarker& marker : joined.markers()) {
    EXPECT_FALSE(marker.surveyed_world_from_marker);
  }
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/map/align.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "waymark/map/parts.h"
#include "waymark/map/testing/random_map.h"

namespace waymark {
namespace {

using testing::RandomMap;

/// Keyframes of a sub-map on a curve, a landmark in front of each, camera 0 off the rig's origin;
/// and a second sub-map, which nothing here should touch.
class MapAlign : public ::testing::Test {
 protected:
  static constexpr int kNumKeyframes = 12;

  MapAlign() {
    auto rig = std::make_shared<Rig>();
    rig->cameras.push_back({nullptr, Rigid3({1.0, 0.0, 0.0, 0.0}, {0.1, 0.0, 0.3})});
    rig_ = rig;
    auto features = std::make_shared<Features>();
    features->rig = rig_;
    features->keypoints.resize(2);
    features->num_primary = 2;
    features->partner.assign(2, kNoFeature);
    features->range_m.assign(2, 0.0f);
    features_ = features;
    submap_ = add_submap();
    other_ = add_submap();
  }

  SubmapId add_submap() {
    const SubmapId submap = map_.add_submap(false);
    KeyframeId parent;
    for (int i = 0; i < kNumKeyframes; ++i) {
      Keyframe keyframe;
      keyframe.submap = submap;
      keyframe.parent = parent;
      keyframe.timestamp_ns = std::int64_t{1'000'000'000} * i;
      keyframe.features = features_;
      const Rigid3 world_from_rig = Rigid3::exp(
          (Vector6d() << 0.3 * i, 0.02 * i * i, 0.1 * i, 0.05 * i, 0.0, 0.1).finished());
      keyframe.rig_from_world = world_from_rig.inverse();
      parent = map_.add_keyframe(std::move(keyframe));
      const LandmarkId landmark =
          map_.add_landmark(submap, world_from_rig * Eigen::Vector3d(0.1, 0.2, 3.0), parent);
      map_.observe(parent, 0, landmark);
      map_.set_appearance(landmark, {{}, Eigen::Vector3d::UnitX(), 0.01});
    }
    return submap;
  }

  Map map_;
  std::shared_ptr<const Rig> rig_;
  std::shared_ptr<const Features> features_;
  SubmapId submap_, other_;
  const Sim3 motion_{Eigen::Quaterniond(0.5, -0.5, 0.1, 0.7).normalized(), {4.0, -2.0, 1.0}, 2.5};
};

TEST_F(MapAlign, TransformMovesAllOfOneSubmap) {
  const std::shared_ptr<const Map> frozen = map_.freeze();
  const Map& before = *frozen;
  map_.add_loop_edge(
      {KeyframeId{9}, KeyframeId{2}, {Eigen::Quaterniond::Identity(), {2.0, 0.0, 0.0}, 1.0}});
  transform_submap(map_, submap_, motion_);
  ASSERT_EQ(map_.broken_invariants(), "");
  before.landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
    const Eigen::Vector3d expected = landmark.submap == submap_
                                         ? motion_ * landmark.position_in_world
                                         : landmark.position_in_world;
    EXPECT_TRUE(map_.landmarks().at(id).position_in_world.isApprox(expected, 1e-12));
  });
  before.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    const bool is_moved = keyframe.submap == submap_;
    const Eigen::Vector3d origin = keyframe.rig_from_world.origin_in_source();
    const Keyframe& moved = map_.keyframes().at(id);
    EXPECT_TRUE(moved.rig_from_world.origin_in_source().isApprox(
        is_moved ? motion_ * origin : origin, 1e-12));
    EXPECT_DOUBLE_EQ(moved.applied_scale, is_moved ? motion_.scale : 1.0);
    // What a keyframe sees stays where it saw it, but for the unit of length.
    const Landmark& landmark = map_.landmarks().at(moved.landmarks[0]);
    EXPECT_TRUE(
        (moved.rig_from_world * landmark.position_in_world)
            .isApprox((is_moved ? motion_.scale : 1.0) * Eigen::Vector3d(0.1, 0.2, 3.0), 1e-9));
  });
  EXPECT_DOUBLE_EQ(map_.loop_edges()[0].to_from_from.translation.norm(), 5.0);
}

TEST_F(MapAlign, TransformIsUndoneByItsInverse) {
  RandomMap random(3);
  Map& map = random.map();
  const std::shared_ptr<const Map> before = map.freeze();
  for (std::uint32_t i = 0; i < map.submaps().size(); ++i) {
    if (!map.submaps()[i].root.is_valid()) continue;
    transform_submap(map, SubmapId{i}, motion_);
    EXPECT_EQ(map.broken_invariants(), "");
    transform_submap(map, SubmapId{i}, motion_.inverse());
  }
  for (KeyframeId id{0}; id < map.keyframes().end_id(); ++id.value) {
    // Also of those that are gone.
    const Rigid3 pose = map.rig_from_world(id, Rigid3(), 1.0);
    EXPECT_TRUE(pose.matrix().isApprox(before->rig_from_world(id, Rigid3(), 1.0).matrix(), 1e-9));
  }
  for (std::size_t i = 0; i < map.loop_edges().size(); ++i) {
    EXPECT_TRUE(map.loop_edges()[i].to_from_from.translation.isApprox(
        before->loop_edges()[i].to_from_from.translation, 1e-9));
  }
}

TEST_F(MapAlign, DistancesGiveTheScale) {
  const auto distance = [&](std::uint32_t a, std::uint32_t b) {
    return (camera_position(map_.keyframes().at(KeyframeId{a})) -
            camera_position(map_.keyframes().at(KeyframeId{b})))
        .norm();
  };
  const std::vector<KnownDistance> one = {{KeyframeId{1}, KeyframeId{7}, 3.0 * distance(1, 7)}};
  EXPECT_DOUBLE_EQ(scale_by_distances(map_, one).value(), 3.0);
  // Of two that contradict each other the longer one counts more.
  const std::vector<KnownDistance> two = {{KeyframeId{0}, KeyframeId{11}, 2.0 * distance(0, 11)},
                                          {KeyframeId{3}, KeyframeId{4}, 4.0 * distance(3, 4)}};
  const double scale = scale_by_distances(map_, two).value();
  EXPECT_GT(scale, 2.0);
  EXPECT_LT(scale, 2.1);
  const std::vector<KnownDistance> none = {{KeyframeId{2}, KeyframeId{2}, 1.0}};
  EXPECT_FALSE(scale_by_distances(map_, none));
}

TEST_F(MapAlign, DeclaresAllThatWasJoinedMetric) {
  RandomMap random(2);
  ASSERT_TRUE(random.map().submaps()[1].joined_into.is_valid() ||
              random.map().submaps()[0].joined_into.is_valid());
  const SubmapId into = random.map().resolve(SubmapId{1});
  const Map metric = declare_metric(random.map(), into);
  EXPECT_EQ(metric.broken_invariants(), "");
  for (std::uint32_t i = 0; i < metric.submaps().size(); ++i) {
    EXPECT_EQ(metric.submaps()[i].is_metric, random.map().resolve(SubmapId{i}) == into) << i;
  }
  EXPECT_TRUE(has_measured_ranges(random.map(), into));
  EXPECT_FALSE(has_measured_ranges(map_, submap_));
}

TEST_F(MapAlign, TurnsUpright) {
  for (const Eigen::Vector3d& up :
       {Eigen::Vector3d(0.1, -2.0, 0.3), Eigen::Vector3d(0.0, 0.0, -1.0)}) {
    EXPECT_TRUE((turn_upright(up) * up.normalized()).isApprox(Eigen::Vector3d::UnitZ(), 1e-12));
  }
  // What is level already keeps its heading.
  EXPECT_TRUE(turn_upright({0.0, 0.0, 3.0}).isApprox(Eigen::Quaterniond::Identity()));
}

TEST_F(MapAlign, FitsATrajectory) {
  std::vector<std::int64_t> times;
  std::vector<Rigid3> poses;
  for (int i = 2; i < kNumKeyframes; ++i) {
    const Keyframe& keyframe = map_.keyframes().at(KeyframeId{static_cast<std::uint32_t>(i)});
    times.push_back(keyframe.timestamp_ns + 3'000'000);
    poses.push_back({Eigen::Quaterniond::Identity(), motion_ * camera_position(keyframe)});
  }
  const auto fit = fit_trajectory(map_, submap_, {times, poses}, 5'000'000, true);
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->num_keyframes, 10u);
  EXPECT_NEAR(fit->trajectory_from_map.scale, 2.5, 1e-9);
  EXPECT_TRUE(fit->trajectory_from_map.translation.isApprox(motion_.translation, 1e-9));
  EXPECT_LT(fit->rms_m, 1e-9);
  const auto rigid = fit_trajectory(map_, submap_, {times, poses}, 5'000'000, false);
  ASSERT_TRUE(rigid);
  EXPECT_EQ(rigid->trajectory_from_map.scale, 1.0);
  EXPECT_GT(rigid->rms_m, 0.5);
  EXPECT_FALSE(fit_trajectory(map_, submap_, {times, poses}, 1'000'000, true));
}

TEST_F(MapAlign, FitsEachPartAsAWhole) {
  RandomMap random(3);  // Its lengths are partly measured.
  Map& map = random.map();
  const SubmapId largest = submaps_by_size(map).front();
  const Rigid3 motion = Rigid3::exp((Vector6d() << 5.0, 1.0, -2.0, 0.3, 0.2, -0.9).finished());
  std::vector<std::pair<std::int64_t, Rigid3>> truth;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    if (keyframe.submap != largest) return;
    truth.push_back({keyframe.timestamp_ns,
                     {Eigen::Quaterniond::Identity(), motion * camera_position(keyframe)}});
  });
  std::sort(
      truth.begin(), truth.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::int64_t> times;
  std::vector<Rigid3> poses;
  for (const auto& [time, pose] : truth) {
    times.push_back(time);
    poses.push_back(pose);
  }
  const Map before = Map::thaw(*map.freeze());
  const auto fits = fit_submaps(map, {times, poses}, 0);
  EXPECT_EQ(fits.size(), submaps_by_size(before).size());
  EXPECT_EQ(map.broken_invariants(), "");
  for (const auto& [submap, fit] : fits) {
    EXPECT_EQ(fit.has_value(), submap == largest);
    EXPECT_EQ(map.submaps()[submap.value].is_metric, submap == largest);
  }
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    const Eigen::Vector3d old = camera_position(before.keyframes().at(id));
    const Eigen::Vector3d expected = keyframe.submap == largest ? motion * old : old;
    EXPECT_LT((camera_position(keyframe) - expected).norm(), 1e-6) << id.value;
  });
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/global_adjustment.h"

#include <gtest/gtest.h>

#include "waymark/map/align.h"
#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

constexpr std::uint32_t kNumKnown = 8;

/// Keyframes in a row before a long cloud, some of which were not there when the adjustment began.
class GlobalAdjustmentTest : public ::testing::TestWithParam<bool> {
 protected:
  GlobalAdjustmentTest()
      : scene_(is_metric() ? 2 : 1,
               scatter_in({-2, -2, 2}, {10, 2, 4}, 2500, 3.0, 3),
               {.seed = 9, .max_features = 500},
               is_metric()) {
    for (std::uint32_t k = 0; k < kNumKnown; ++k) scene_.add_keyframe(row_pose(k));
  }

  static bool is_metric() { return GetParam(); }

  /// Bends the map and, in mono, lets it grow from keyframe to keyframe.
  void bend() {
    MapCorrection bent;
    for (std::uint32_t k = 1; k < kNumKnown; ++k) {
      const Vector6d twist = (Vector6d() << 0.004, 0.0, 0.002, 0.0, 0.002, 0.001).finished() * k;
      bent.keyframes.push_back({KeyframeId{k},
                                Rigid3::exp(twist) * row_pose(k).inverse(),
                                is_metric() ? 1.0 : 1.0 + 0.01 * k});
    }
    apply_correction(scene_.map, bent);
  }

  /// Error of the way from a keyframe to the next, as a part of it.
  double step_error(std::uint32_t keyframe) const {
    const auto place = [&](std::uint32_t k) {
      return scene_.map.keyframes().at(KeyframeId{k}).rig_from_world.origin_in_source();
    };
    const double truth =
        (row_pose(keyframe + 1).translation - row_pose(keyframe).translation).norm();
    const double unit = is_metric()
                            ? 1.0
                            : (place(1) - place(0)).norm() /
                                  (row_pose(1).translation - row_pose(0).translation).norm();
    return std::abs((place(keyframe + 1) - place(keyframe)).norm() / unit - truth) / truth;
  }

  TestMap scene_;
  DirtyLandmarks dirty_;
};

TEST_P(GlobalAdjustmentTest, LeavesTheFrozenMapAndMendsTheLivingOne) {
  bend();
  const auto frozen = scene_.map.freeze();
  const GlobalAdjustment adjustment = adjust_globally(*frozen, scene_.submap);
  EXPECT_EQ(adjustment.correction.keyframes.size(), std::size_t{kNumKnown - 1});
  const double scale = adjustment.correction.keyframes.back().scale;
  if (is_metric()) {
    EXPECT_EQ(scale, 1.0);
  } else {  // The map had grown.
    EXPECT_LT(scale, 0.99);
    EXPECT_GT(scale, 1.0 / (1.0 + 0.01 * kNumKnown));
  }
  // The map goes on meanwhile: a keyframe more, one landmark and one observation less.
  const Rigid3 known = row_pose(kNumKnown - 1).inverse();
  const Rigid3 next_from_known = row_pose(kNumKnown).inverse() * known.inverse();
  const KeyframeId younger = scene_.add_keyframe(row_pose(kNumKnown));
  const Keyframe& last = scene_.map.keyframes().at(KeyframeId{kNumKnown - 1});
  Rigid3 moved = next_from_known;  // As long as lengths are where it was tracked.
  moved.translation /= scale;
  scene_.map.move_keyframe(younger, moved * last.rig_from_world);
  scene_.map.erase_landmark(LandmarkId{0});
  apply_adjustment(scene_.map, adjustment, dirty_);
  EXPECT_EQ(scene_.map.broken_invariants(), "");
  for (std::uint32_t k = 0; k < kNumKnown; ++k) EXPECT_LT(step_error(k), 0.01) << k;
}

TEST_P(GlobalAdjustmentTest, IsCarriedOverToAMapThatMoved) {
  bend();
  const auto frozen = scene_.map.freeze();
  GlobalAdjustment adjustment = adjust_globally(*frozen, scene_.submap);
  const GlobalAdjustment as_found = adjustment;
  const Sim3 motion(Sim3::exp((Vector7d() << 0.3, -0.1, 0.2, 0.1, 0.2, -0.1, 0.0).finished()));
  Sim3 resized = motion;
  if (!is_metric()) resized.scale = 1.5;
  transform_submap(scene_.map, scene_.submap, resized);
  rebase(*frozen, scene_.map, adjustment);
  apply_adjustment(scene_.map, adjustment, dirty_);
  EXPECT_EQ(scene_.map.broken_invariants(), "");
  for (std::uint32_t k = 0; k + 1 < kNumKnown; ++k) EXPECT_LT(step_error(k), 0.01) << k;
  for (const auto& move : as_found.correction.landmarks) {
    const Landmark* const landmark = scene_.map.landmarks().find(move.landmark);
    if (!landmark) continue;
    EXPECT_LT((landmark->position_in_world - resized * move.position_in_world).norm(), 1e-6);
  }
}

TEST_P(GlobalAdjustmentTest, OfAnEmptySubmapIsNothing) {
  const SubmapId empty = scene_.map.add_submap(is_metric());
  const GlobalAdjustment adjustment = adjust_globally(*scene_.map.freeze(), empty);
  EXPECT_TRUE(adjustment.correction.keyframes.empty());
  EXPECT_TRUE(adjustment.landmarks.empty());
}

INSTANTIATE_TEST_SUITE_P(Setups, GlobalAdjustmentTest, ::testing::Bool(), [](const auto& info) {
  return info.param ? "stereo" : "mono";
});

}  // namespace
}  // namespace waymark

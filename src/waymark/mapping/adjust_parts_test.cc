// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/adjust_parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

constexpr std::uint32_t kNumKeyframes = 24;
constexpr std::size_t kPartSize = 8;

/// Keyframes in a row before a long cloud.
class AdjustPartsTest : public ::testing::TestWithParam<bool> {
 protected:
  AdjustPartsTest()
      : scene_(is_metric() ? 2 : 1,
               scatter_in({-2, -2, 2}, {14, 2, 4}, 4000, 3.0, 3),
               {.seed = 9, .max_features = 300},
               is_metric()) {
    for (std::uint32_t k = 0; k < kNumKeyframes; ++k) scene_.add_keyframe(row_pose(k));
  }

  static bool is_metric() { return GetParam(); }

  /// Moves every keyframe but the first two by some centimetres.
  void shake() {
    Rng rng(1, 0);
    for (std::uint32_t k = 2; k < kNumKeyframes; ++k) {
      const Rigid3& pose = scene_.map.keyframes().at(KeyframeId{k}).rig_from_world;
      Vector6d twist;
      for (int i = 0; i < 6; ++i) twist[i] = (i < 3 ? 0.02 : 0.004) * rng.normal();
      scene_.map.move_keyframe(KeyframeId{k}, Rigid3::exp(twist) * pose);
    }
  }

  /// Root mean square of what steps from one keyframe to the next are off the truth, in metres.
  static double step_error(const MapCorrection& places) {
    double sum = 0.0;
    for (std::size_t i = 1; i < places.keyframes.size(); ++i) {
      const auto& [a, a_from_world, scale_a] = places.keyframes[i - 1];
      const auto& [b, b_from_world, scale_b] = places.keyframes[i];
      const Eigen::Vector3d step =
          b_from_world.origin_in_source() - a_from_world.origin_in_source();
      sum += (step - (row_pose(b.value).translation - row_pose(a.value).translation)).squaredNorm();
    }
    return std::sqrt(sum / static_cast<double>(places.keyframes.size() - 1));
  }

  WindowAdjustment adjust() const {
    const BundleWindow all = whole_submap(scene_.map, scene_.submap);
    return compute_adjustment_in_parts(
        scene_.map, all, {.max_iterations_per_round = 20}, kPartSize);
  }

  TestMap scene_;
};

TEST_P(AdjustPartsTest, PartsAreSmallAndHoldEachKeyframeOnce) {
  std::vector<KeyframeId> all;
  for (std::uint32_t k = 0; k < kNumKeyframes; ++k) all.push_back(KeyframeId{k});
  for (const double share : {0.5, 0.4}) {
    std::vector<KeyframeId> seen;
    for (const auto& part : divide_by_place(scene_.map, all, kPartSize, share)) {
      EXPECT_LE(part.size(), kPartSize);
      EXPECT_TRUE(std::is_sorted(part.begin(), part.end()));
      // Neighbours in the row stay together.
      EXPECT_EQ(part.back().value - part.front().value + 1, part.size());
      seen.insert(seen.end(), part.begin(), part.end());
    }
    std::sort(seen.begin(), seen.end());
    EXPECT_EQ(seen, all);
  }
  EXPECT_TRUE(divide_by_place(scene_.map, {}, kPartSize, 0.5).empty());
}

TEST_P(AdjustPartsTest, BordersLieElsewhereWithAnotherShare) {
  std::vector<KeyframeId> all;
  for (std::uint32_t k = 0; k < kNumKeyframes; ++k) all.push_back(KeyframeId{k});
  std::vector<KeyframeId> firsts;
  for (const double share : {0.5, 0.4}) {
    for (const auto& part : divide_by_place(scene_.map, all, kNumKeyframes / 2, share)) {
      if (part.front() != KeyframeId{0}) firsts.push_back(part.front());
    }
  }
  EXPECT_GE(firsts.size(), 2u);
  std::sort(firsts.begin(), firsts.end());
  EXPECT_EQ(std::ranges::adjacent_find(firsts), firsts.end());
}

TEST_P(AdjustPartsTest, MendsWhatWasShaken) {
  shake();
  const BundleWindow all = whole_submap(scene_.map, scene_.submap);
  const double before = [&] {
    MapCorrection as_is;
    for (const KeyframeId id : all.moving) {
      as_is.keyframes.push_back({id, scene_.map.keyframes().at(id).rig_from_world});
    }
    return step_error(as_is);
  }();
  const WindowAdjustment found = adjust();
  EXPECT_EQ(found.correction.keyframes.size(), all.moving.size());
  EXPECT_EQ(found.correction.landmarks.size(), all.landmarks.size());
  EXPECT_LT(step_error(found.correction), 0.3 * before);
  const WindowAdjustment again = adjust();
  for (std::size_t i = 0; i < all.moving.size(); ++i) {
    EXPECT_EQ(found.correction.keyframes[i].rig_from_world.matrix(),
              again.correction.keyframes[i].rig_from_world.matrix());
  }
}

TEST_P(AdjustPartsTest, NamesAWrongObservationOnce) {
  const KeyframeId id{kNumKeyframes / 2};  // At a border of the first pass.
  const auto& landmarks = scene_.map.keyframes().at(id).landmarks;
  std::vector<std::uint32_t> features;
  for (std::uint32_t i = 0; i < scene_.seen[id.value].features->num_primary; ++i) {
    if (landmarks[i].is_valid() && num_observers(scene_.map.landmarks().at(landmarks[i])) > 3) {
      features.push_back(i);
    }
  }
  ASSERT_GT(features.size(), 20u);
  const std::uint32_t a = features.front(), b = features.back();
  const LandmarkId of_a = landmarks[a], of_b = landmarks[b];
  scene_.map.forget(id, a);
  scene_.map.forget(id, b);
  scene_.map.observe(id, a, of_b);
  scene_.map.observe(id, b, of_a);
  const WindowAdjustment found = adjust();
  EXPECT_EQ(std::ranges::count(found.outliers, Observation{id, a}), 1);
  EXPECT_EQ(std::ranges::count(found.outliers, Observation{id, b}), 1);
}

INSTANTIATE_TEST_SUITE_P(Setups, AdjustPartsTest, ::testing::Bool(), [](const auto& info) {
  return info.param ? "stereo" : "mono";
});

}  // namespace
}  // namespace waymark

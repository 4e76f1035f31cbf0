// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/bundle_window.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "waymark/geometry/alignment.h"
#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

template <class T>
bool contains(const std::vector<T>& sorted, T value) {
  return std::binary_search(sorted.begin(), sorted.end(), value);
}

/// Keyframes in a row before a long cloud: near ones share landmarks.
class BundleWindowTest : public ::testing::TestWithParam<int> {
 protected:
  static constexpr std::uint32_t kNumKeyframes = 10;

  BundleWindowTest()
      : scene_(GetParam(),
               scatter_in({-2, -2, 2}, {10, 2, 4}, 2500, 3.0, 3),
               {.seed = 9, .max_features = 500},
               GetParam() > 1) {
    for (std::uint32_t k = 0; k < kNumKeyframes; ++k) scene_.add_keyframe(row_pose(k));
  }

  static KeyframeId last() { return KeyframeId{kNumKeyframes - 1}; }

  void move_pose(KeyframeId id, Rng& rng, double amount) {
    Vector6d tangent;
    for (int i = 0; i < 6; ++i) tangent[i] = amount * rng.normal();
    const Rigid3& pose = scene_.map.keyframes().at(id).rig_from_world;
    scene_.map.move_keyframe(id, Rigid3::exp(tangent) * pose);
  }

  /// Distance of the keyframes' places from the truth after alignment, with scale in mono.
  double place_error() const {
    std::vector<Eigen::Vector3d> estimated, expected;
    for (std::uint32_t k = 0; k < kNumKeyframes; ++k) {
      estimated.push_back(
          scene_.map.keyframes().at(KeyframeId{k}).rig_from_world.origin_in_source());
      expected.push_back(row_pose(k).translation);
    }
    const auto aligned = align_similarity(estimated, expected);
    if (!aligned) return INFINITY;
    double largest = 0.0;
    for (std::size_t k = 0; k < estimated.size(); ++k) {
      largest = std::max(largest, (*aligned * estimated[k] - expected[k]).norm());
    }
    return largest;
  }

  TestMap scene_;
  DirtyLandmarks dirty_;
};

TEST_P(BundleWindowTest, MovesTheNearestAndIsHeldByThoseWhoSeeTheSame) {
  const BundleWindow window = choose_window(scene_.map, last(), 4);
  EXPECT_EQ(window.moving.size(), 4u);
  EXPECT_TRUE(contains(window.moving, last()));
  for (const KeyframeId id : window.moving) EXPECT_GE(id.value, kNumKeyframes - 5) << id.value;
  EXPECT_FALSE(window.fixed.empty());
  for (const KeyframeId id : window.fixed) EXPECT_FALSE(contains(window.moving, id));
  EXPECT_TRUE(std::is_sorted(window.moving.begin(), window.moving.end()));
  EXPECT_TRUE(std::is_sorted(window.fixed.begin(), window.fixed.end()));
  // All that the moving ones see, and nothing else.
  scene_.map.landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
    const bool is_seen = std::any_of(window.moving.begin(), window.moving.end(), [&](KeyframeId k) {
      return is_observed_by(landmark, k);
    });
    EXPECT_EQ(contains(window.landmarks, id), is_seen);
  });
  for (const KeyframeId id : window.fixed) {
    EXPECT_TRUE(std::any_of(window.landmarks.begin(), window.landmarks.end(), [&](LandmarkId l) {
      return is_observed_by(scene_.map.landmarks().at(l), id);
    })) << id.value;
  }
}

TEST_P(BundleWindowTest, NeverMovesTheRoot) {
  for (const std::size_t size : {2u, 20u}) {
    const BundleWindow window = choose_window(scene_.map, KeyframeId{1}, size);
    EXPECT_FALSE(contains(window.moving, KeyframeId{0}));
    EXPECT_TRUE(contains(window.fixed, KeyframeId{0}));
  }
  const BundleWindow whole = whole_submap(scene_.map, scene_.submap);
  EXPECT_FALSE(contains(whole.moving, KeyframeId{0}));
  EXPECT_EQ(whole.moving.size() + whole.fixed.size(), std::size_t{kNumKeyframes});
  EXPECT_EQ(whole.landmarks.size(), scene_.map.landmarks().size());
}

TEST_P(BundleWindowTest, HoldsOneKeyframeWhereNothingElseDoes) {
  // In mono too: to hold the second one would hold the error of the first, short baseline.
  const BundleWindow whole = whole_submap(scene_.map, scene_.submap);
  EXPECT_EQ(whole.fixed, std::vector<KeyframeId>{KeyframeId{0}});
  const BundleWindow window = choose_window(scene_.map, last(), kNumKeyframes);
  EXPECT_EQ(window.fixed, std::vector<KeyframeId>{KeyframeId{0}});
}

TEST_P(BundleWindowTest, BringsAMovedKeyframeBack) {
  Rng rng(1, 0);
  move_pose(last(), rng, 0.01);
  ASSERT_GT(place_error(), 0.005);
  const BundleWindow window = choose_window(scene_.map, last(), 4);
  adjust_window(scene_.map, window, {}, dirty_);
  EXPECT_EQ(scene_.map.broken_invariants(), "");
  EXPECT_LT(place_error(), 0.005);
  EXPECT_EQ(scene_.map.keyframes().at(KeyframeId{0}).rig_from_world.matrix(),
            row_pose(0).inverse().matrix());
  for (const LandmarkId id : window.landmarks) {
    EXPECT_EQ(dirty_.count(id), scene_.map.landmarks().contains(id) ? 1u : 0u);
  }
}

TEST_P(BundleWindowTest, AdjustsAWholeSubmap) {
  Rng rng(2, 0);
  for (std::uint32_t k = 2; k < kNumKeyframes; ++k) move_pose(KeyframeId{k}, rng, 0.01);
  ASSERT_GT(place_error(), 0.01);
  adjust_window(scene_.map,
                whole_submap(scene_.map, scene_.submap),
                {.max_iterations_per_round = 30},
                dirty_);
  EXPECT_LT(place_error(), 0.01);
}

TEST_P(BundleWindowTest, DropsAWrongObservation) {
  // The newest keyframe's features trade landmarks.
  const auto& landmarks = scene_.map.keyframes().at(last()).landmarks;
  std::vector<std::uint32_t> features;
  for (std::uint32_t i = 0; i < scene_.seen.back().features->num_primary; ++i) {
    if (landmarks[i].is_valid() && num_observers(scene_.map.landmarks().at(landmarks[i])) > 2) {
      features.push_back(i);
    }
  }
  ASSERT_GT(features.size(), 20u);
  const std::uint32_t a = features.front(), b = features.back();
  const LandmarkId of_a = landmarks[a], of_b = landmarks[b];
  scene_.map.forget(last(), a);
  scene_.map.forget(last(), b);
  scene_.map.observe(last(), a, of_b);
  scene_.map.observe(last(), b, of_a);
  adjust_window(scene_.map, choose_window(scene_.map, last(), 4), {}, dirty_);
  EXPECT_FALSE(scene_.map.keyframes().at(last()).landmarks[a].is_valid());
  EXPECT_FALSE(scene_.map.keyframes().at(last()).landmarks[b].is_valid());
  EXPECT_TRUE(scene_.map.landmarks().contains(of_a)) << "others see it";
  EXPECT_EQ(scene_.map.broken_invariants(), "");
}

TEST_P(BundleWindowTest, ErasesLandmarksThatLoseTheirSupport) {
  // One that two keyframes see in places that no point explains.
  const KeyframeId other{kNumKeyframes - 2};
  const auto free_feature = [&](KeyframeId id, int skip) {
    const Keyframe& keyframe = scene_.map.keyframes().at(id);
    for (std::uint32_t i = 0; i < keyframe.features->num_primary; ++i) {
      if (!keyframe.landmarks[i].is_valid()) continue;
      if (skip-- > 0) continue;
      scene_.map.forget(id, i);
      // One range that fits would be support enough.
      auto features = std::make_shared<Features>(*keyframe.features);
      features->range_m[i] = 0.0f;
      scene_.map.recompute_keyframe(id, features);
      return i;
    }
    return kNoFeature;
  };
  const LandmarkId id = scene_.map.add_landmark(scene_.submap, {4.5, 0.0, 3.0}, last());
  scene_.map.observe(last(), free_feature(last(), 0), id);
  scene_.map.observe(other, free_feature(other, 60), id);
  const auto erased = adjust_window(scene_.map, choose_window(scene_.map, last(), 4), {}, dirty_);
  EXPECT_FALSE(scene_.map.landmarks().contains(id));
  EXPECT_TRUE(std::find(erased.begin(), erased.end(), id) != erased.end());
  EXPECT_EQ(dirty_.count(id), 0u);
  EXPECT_EQ(scene_.map.broken_invariants(), "");
}

TEST_P(BundleWindowTest, LeavesOutRangesOfSomethingElse) {
  // A pattern that repeats: each third feature of the newest keyframe looks half as far away. Its
  // bearing is still good.
  Keyframe keyframe = scene_.map.keyframes().at(last());
  auto features = std::make_shared<Features>(*keyframe.features);
  for (std::uint32_t i = 0; i < features->num_primary; i += 3) features->range_m[i] *= 0.5f;
  scene_.map.recompute_keyframe(last(), features);
  adjust_window(scene_.map, choose_window(scene_.map, last(), 4), {}, dirty_);
  EXPECT_LT(place_error(), 0.003);
}

INSTANTIATE_TEST_SUITE_P(Cameras, BundleWindowTest, ::testing::Values(1, 2), [](const auto& info) {
  return info.param == 1 ? "mono" : "stereo";
});

TEST(IsSupported, ByTwoViewsOrByARange) {
  TestMap mono(1, cloud_ahead(), {.seed = 9}, false);
  const KeyframeId first = mono.add_keyframe(pose_at(0.0));
  LandmarkId seen;
  for (const LandmarkId id : mono.map.keyframes().at(first).landmarks) {
    if (id.is_valid()) seen = id;
  }
  EXPECT_FALSE(is_supported(mono.map, mono.map.landmarks().at(seen)));
  mono.add_keyframe(pose_at(0.1));
  std::size_t num_supported = 0, num_twice = 0;
  mono.map.landmarks().for_each([&](LandmarkId, const Landmark& landmark) {
    num_supported += is_supported(mono.map, landmark);
    num_twice += num_observers(landmark) == 2;
  });
  EXPECT_EQ(num_supported, num_twice);

  TestMap rgbd(1, cloud_ahead(), {.seed = 9, .inverse_range_sigma = 0.002}, true);
  rgbd.add_keyframe(pose_at(0.0));
  std::size_t num_by_range = 0;
  rgbd.map.landmarks().for_each([&](LandmarkId, const Landmark& landmark) {
    num_by_range += is_supported(rgbd.map, landmark);
  });
  // All whose range errs by less than three standard deviations.
  EXPECT_GT(num_by_range, rgbd.map.landmarks().size() * 99 / 100);
  const LandmarkId some = rgbd.map.keyframes().at(KeyframeId{0}).landmarks[0];
  Landmark moved = rgbd.map.landmarks().at(some);
  moved.position_in_world *= 2.0;
  EXPECT_FALSE(is_supported(rgbd.map, moved)) << "the range is of something else";
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/appearance.h"

#include <gtest/gtest.h>

#include "waymark/features/hamming.h"
#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

/// A landmark seen by keyframes whose one feature is set by hand.
class AppearanceTest : public ::testing::Test {
 protected:
  AppearanceTest() {
    submap_ = map_.add_submap(true);
    rig_ = make_test_rig(1);
  }

  KeyframeId add_keyframe(const Eigen::Vector3d& position,
                          const Descriptor& descriptor,
                          float size_rad) {
    auto features = std::make_shared<Features>();
    features->rig = rig_;
    features->num_primary = 1;
    features->keypoints.resize(1);
    features->descriptors = {descriptor};
    features->size_rad = {size_rad};
    features->partner = {kNoFeature};
    Keyframe keyframe;
    keyframe.submap = submap_;
    keyframe.features = features;
    keyframe.rig_from_world = Rigid3(Eigen::Quaterniond::Identity(), position).inverse();
    const std::uint32_t number = map_.keyframes().end_id().value;
    if (number > 0) keyframe.parent = KeyframeId{number - 1};
    return map_.add_keyframe(std::move(keyframe));
  }

  static Descriptor with_bits(int count) {
    Descriptor descriptor{};
    for (int bit = 0; bit < count; ++bit) descriptor[bit / 64] |= std::uint64_t{1} << (bit % 64);
    return descriptor;
  }

  Map map_;
  SubmapId submap_;
  std::shared_ptr<const Rig> rig_;
};

TEST_F(AppearanceTest, IsTheMiddleOfItsDescriptors) {
  const std::vector<int> bits = {0, 1, 2, 100, 130};  // Medians: 2, 1, 2, 98, 128.
  for (const int count : bits) add_keyframe({0, 0, 0}, with_bits(count), 0.002f);
  const LandmarkId id = map_.add_landmark(submap_, {0, 0, 5}, KeyframeId{0});
  for (std::uint32_t k = 0; k < bits.size(); ++k) map_.observe(KeyframeId{k}, 0, id);
  EXPECT_EQ(hamming_distance(describe_landmark(map_, id).descriptor, with_bits(1)), 0);
}

TEST_F(AppearanceTest, LooksTowardsItsObserversOnAverage) {
  add_keyframe({-5, 0, 0}, with_bits(1), 0.002f);
  add_keyframe({5, 0, 0}, with_bits(1), 0.002f);
  const LandmarkId id = map_.add_landmark(submap_, {0, 0, 5}, KeyframeId{0});
  map_.observe(KeyframeId{0}, 0, id);
  const Eigen::Vector3d alone = describe_landmark(map_, id).direction;
  EXPECT_TRUE(alone.isApprox(Eigen::Vector3d(-1, 0, -1).normalized(), 1e-12));
  map_.observe(KeyframeId{1}, 0, id);
  const Eigen::Vector3d both = describe_landmark(map_, id).direction;
  EXPECT_TRUE(both.isApprox(Eigen::Vector3d(0, 0, -1), 1e-12));
}

TEST_F(AppearanceTest, HasTheSizeOfAPixelOfItsReference) {
  add_keyframe({0, 0, 0}, with_bits(1), 0.002f);
  add_keyframe({0, 0, 2}, with_bits(1), 0.01f);
  const LandmarkId id = map_.add_landmark(submap_, {0, 0, 5}, KeyframeId{1});
  map_.observe(KeyframeId{1}, 0, id);
  map_.observe(KeyframeId{0}, 0, id);
  EXPECT_NEAR(describe_landmark(map_, id).size_m, 3 * 0.01, 1e-6);
  map_.forget(KeyframeId{1}, 0);
  EXPECT_NEAR(describe_landmark(map_, id).size_m, 5 * 0.002, 1e-6) << "the only one there is";
}

TEST_F(AppearanceTest, StaysAsItWasWithoutObservations) {
  add_keyframe({0, 0, 0}, with_bits(1), 0.002f);
  const LandmarkId id = map_.add_landmark(submap_, {0, 0, 5}, KeyframeId{0});
  map_.set_appearance(id, {with_bits(7), Eigen::Vector3d::UnitY(), 0.25});
  const Appearance appearance = describe_landmark(map_, id);
  EXPECT_EQ(hamming_distance(appearance.descriptor, with_bits(7)), 0);
  EXPECT_EQ(appearance.direction, Eigen::Vector3d::UnitY());
  EXPECT_EQ(appearance.size_m, 0.25);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/feature_prefetch.h"

#include <gtest/gtest.h>

#include <memory>

#include "waymark/base/check.h"
#include "waymark/camera/fisheye.h"
#include "waymark/camera/perspective.h"
#include "waymark/image/small_image.h"
#include "waymark/system/testing/sequence.h"

namespace waymark {
namespace {

const std::shared_ptr<const void> kForever = std::make_shared<int>(0);

FrameSettings few_features() { return {.features = {.count = 300}}; }

TEST(FeaturePrefetch, FindsWhatTheBuilderFinds) {
  FrameBuilder builder(small_rig(), few_features()), alone(small_rig(), few_features());
  FeaturePrefetch prefetch(builder, few_features(), 3);
  EXPECT_EQ(prefetch.capacity(), 6u);
  for (std::size_t i = 0; i < 8; ++i) prefetch.prepare(input_of(frames()[i]), kForever);
  for (std::size_t i = 0; i < 8; ++i) {
    const FrameImages images = input_of(frames()[i]);
    std::optional<FoundFrame> found = prefetch.take(images);
    ASSERT_EQ(found.has_value(), i < 6) << "there is room for six";
    if (!found) continue;
    const auto features = builder.build(*std::move(found), images, {});
    const auto expected = alone.build(images);
    EXPECT_EQ(features->descriptors, expected->descriptors);
    EXPECT_EQ(features->bearings, expected->bearings);
    EXPECT_EQ(features->range_m, expected->range_m);
    EXPECT_EQ(builder.small_image()->detail.values, alone.small_image()->detail.values);
  }
}

TEST(FeaturePrefetch, LooksAgainWhereTheCalibrationIsAnother) {
  FrameBuilder builder(small_rig(), few_features());
  FeaturePrefetch prefetch(builder, few_features(), 2);
  for (std::size_t i = 0; i < 4; ++i) prefetch.prepare(input_of(frames()[i]), kForever);
  Rig another = small_rig();
  another.cameras[0].camera = std::make_shared<PerspectiveCamera>(
      PerspectiveModel({231.0, 231.0}, {159.5, 119.5}), 320, 240);
  for (std::size_t i = 0; i < 4; ++i) {
    if (i == 2) builder.set_calibration(std::make_shared<const Rig>(another));
    const FrameImages images = input_of(frames()[i]);
    std::optional<FoundFrame> found = prefetch.take(images);
    ASSERT_TRUE(found);
    FrameBuilder fresh(i < 2 ? small_rig() : another, few_features());
    EXPECT_EQ(found->features->bearings, fresh.build(images)->bearings) << "frame " << i;
  }
}

TEST(FeaturePrefetch, ForgetsWhatIsNotFed) {
  FrameBuilder builder(small_rig(), few_features());
  FeaturePrefetch prefetch(builder, few_features(), 2);
  const auto owner = std::make_shared<int>(0);
  for (std::size_t i = 1; i < 4; ++i) prefetch.prepare(input_of(frames()[i]), owner);
  prefetch.prepare(input_of(frames()[2]), owner);  // Not after those before: left out.
  EXPECT_FALSE(prefetch.take(input_of(frames()[0]))) << "was not prepared, and they come later";
  FrameImages other = input_of(frames()[2]);
  other.image0 = frames()[5].images[0].view();
  EXPECT_FALSE(prefetch.take(other)) << "other images of that time";
  EXPECT_TRUE(prefetch.take(input_of(frames()[3])));
  EXPECT_FALSE(prefetch.take(input_of(frames()[4])));
}

TEST(FeaturePrefetch, HandsOnThatImagesAreOfAnotherSize) {
  FrameBuilder builder(small_rig(), few_features());
  FeaturePrefetch prefetch(builder, few_features(), 2);
  FrameImages wrong = input_of(frames()[0]);
  wrong.image0.height_px -= 1;
  prefetch.prepare(wrong, kForever);
  prefetch.prepare(input_of(frames()[1]), kForever);
  EXPECT_THROW(prefetch.take(wrong), InputError);
  EXPECT_TRUE(prefetch.take(input_of(frames()[1])));
}

TEST(FeaturePrefetch, WaitsUntilTheImageCircleIsKnown) {
  const auto fisheye = std::make_shared<FisheyeCamera>(
      FisheyeModel({{100.0, 100.0}, {159.5, 119.5}}, {0.0, 0.0, 0.0, 0.0}), 320, 240);
  FrameBuilder builder({{{fisheye, Rigid3()}}}, few_features());
  FeaturePrefetch prefetch(builder, few_features(), 2);
  for (std::size_t i = 0; i < 15; ++i) {
    FrameImages images = input_of(frames()[i]);
    images.depth = {};
    prefetch.prepare(images, kForever);
    std::optional<FoundFrame> found = prefetch.take(images);
    EXPECT_EQ(found.has_value(), i >= static_cast<std::size_t>(ViewMask::kNumLearned));
    if (!found) builder.build(images);
  }
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/features.h"

#include <gtest/gtest.h>

namespace waymark {
namespace {

// Measured, beyond infinity, unknown; and one of camera 1.
TEST(Features, MeasureInverseRangesOfEitherSign) {
  Features features;
  features.num_primary = 3;
  features.keypoints.resize(4);
  features.bearings.resize(4);
  features.level_pixel_from_bearing.resize(4);
  features.range_m = {4.0f, -50.0f, 0.0f};
  features.inverse_range_sigma = {0.125f, 0.25f, 0.0f};
  EXPECT_EQ(features.measurement(0).inverse_range, 0.25f);
  EXPECT_EQ(features.measurement(0).inverse_range_sigma, 0.125f);
  EXPECT_EQ(features.measurement(1).inverse_range, -0.02f);
  EXPECT_EQ(features.measurement(1).inverse_range_sigma, 0.25f);
  for (const std::uint32_t feature : {2u, 3u}) {
    EXPECT_EQ(features.measurement(feature).inverse_range, 0.0f) << feature;
    EXPECT_EQ(features.measurement(feature).inverse_range_sigma, 0.0f) << feature;
  }
}

}  // namespace
}  // namespace waymark

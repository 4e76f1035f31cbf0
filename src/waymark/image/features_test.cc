// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/features.h"

#include <gtest/gtest.h>

namespace waymark {
namespace {

// Measured by the depth image, derived from stereo, unknown; and one of camera 1.
TEST(Features, OnlyADepthImageMeasuresInverseRanges) {
  Features features;
  features.num_primary = 3;
  features.keypoints.resize(4);
  features.bearings.resize(4);
  features.level_pixel_from_bearing.resize(4);
  features.range_m = {4.0f, 2.0f, 0.0f};
  features.inverse_range_sigma = {0.125f, 0.0f, 0.0f};
  const Measurement measured = features.measurement(0);
  EXPECT_EQ(measured.inverse_range, 0.25f);
  EXPECT_EQ(measured.inverse_range_sigma, 0.125f);
  for (const std::uint32_t feature : {1u, 2u, 3u}) {
    EXPECT_EQ(features.measurement(feature).inverse_range, 0.0f) << feature;
    EXPECT_EQ(features.measurement(feature).inverse_range_sigma, 0.0f) << feature;
  }
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "waymark/calibration/testing/calibration.h"
#include "waymark/mapping/global_adjustment.h"

namespace waymark {
namespace {

/// Keyframes whose depth images are exact but for noise, and told to be off.
GlobalAdjustment adjust(double told_offset, double inverse_range_sigma = 2e-3) {
  const auto truth = make_described(1, make_test_pinhole(420.0));
  const auto told = std::make_shared<const Rig>(with_depth_offset(*truth, told_offset));
  TestMap scene = look_around(truth, told, 12, 0.3, inverse_range_sigma);
  const KnownCalibration known = KnownCalibration::as_given(told);
  return adjust_with_calibration(*scene.map.freeze(), known);
}

TEST(DepthOffset, IsFound) {
  for (const double told_offset : {0.03, -0.02}) {
    const GlobalAdjustment found = adjust(told_offset);
    ASSERT_TRUE(found.calibration.has_value()) << told_offset;
    EXPECT_NEAR(found.calibration->rig->inverse_depth_offset, 0.0, 1e-3);
    EXPECT_TRUE(found.calibration->is_changed());
    const CalibrationEstimate estimate = found.calibration->estimates().back();
    EXPECT_EQ(estimate.name, "depth.inverse_offset");
    EXPECT_EQ(estimate.given, told_offset);
    EXPECT_NEAR(estimate.change, -told_offset, 1e-3);
    EXPECT_LT(std::abs(estimate.change + told_offset), 4.0 * estimate.sigma);
  }
}

TEST(DepthOffset, OfGoodDepthIsLeftAlone) { EXPECT_FALSE(adjust(0.0).calibration.has_value()); }

TEST(DepthOffset, IsNoneWithoutDepth) { EXPECT_FALSE(adjust(0.03, 0.0).calibration.has_value()); }

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>

#include "waymark/camera/camchain.h"
#include "waymark/features/feature_geometry.h"
#include "waymark/mapping/global_adjustment.h"
#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

std::shared_ptr<const Rig> make_rolling(double readout_s) {
  CameraChain chain;
  chain.cameras.push_back(
      {{"pinhole", {420.0, 420.0, 319.5, 239.5}, "none", {}, 640, 480, ""}, Rigid3(), readout_s});
  return std::make_shared<const Rig>(make_rig(chain));
}

CalibrationEstimate readout_of(const GlobalAdjustment& found) {
  const std::vector<CalibrationEstimate> estimates = found.calibration->estimates();
  const auto readout = std::ranges::find(estimates, "readout_ms", &CalibrationEstimate::name);
  return readout == estimates.end() ? CalibrationEstimate{} : *readout;
}

/// Keyframes of a hand that turns, seen by one shutter and told of another.
class ReadoutTest : public ::testing::Test {
 protected:
  GlobalAdjustment adjust(double readout_s, double told_s) {
    const std::shared_ptr<const Rig> at_once = make_rolling(0.0);
    TestMap scene(1,
                  scatter_in({-6.0, -4.0, 3.0}, {6.0, 4.0, 9.0}, 2000, 6.0, 3),
                  {.seed = 9, .pixel_sigma = 0.3, .max_features = 500},
                  false);
    scene.rig = at_once;
    const auto told = make_rolling(told_s);
    for (std::uint32_t k = 0; k < 12; ++k) {
      const KeyframeId id =
          scene.add_keyframe(make_test_pose({0.15 * k, 0.1 * (k % 3), 0.1 * (k % 5)},
                                            {0.1 * (k % 4 - 1.5), 0.12 * (k % 5 - 2), 0.0}));
      RigMotion motion;
      motion.turn_rad_s = {0.3f * (k % 3 - 1.0f), 0.5f * (k % 4 - 1.5f), 0.2f * (k % 5 - 2.0f)};
      // To bend an image is to correct it for a shutter that rolls upwards.
      const auto bent =
          recompute(*scene.map.keyframes().at(id).features, make_rolling(-readout_s), motion);
      Features seen = *bent;
      seen.readout_s = {};
      scene.map.recompute_keyframe(id, recompute(seen, told, motion));
      scene.map.set_motion(id, motion);
    }
    const KnownCalibration known = KnownCalibration::as_given(told);
    return adjust_with_calibration(*scene.map.freeze(), known);
  }
};

TEST_F(ReadoutTest, IsFound) {
  const GlobalAdjustment found = adjust(0.02, 0.0);
  ASSERT_TRUE(found.calibration.has_value());
  const double readout_s = found.calibration->rig->cameras[0].readout_s;
  EXPECT_NEAR(readout_s, 0.02, 1e-3);
  EXPECT_TRUE(found.calibration->is_changed());
  const CalibrationEstimate estimate = readout_of(found);
  EXPECT_LT(std::abs(estimate.change - 20.0), 4.0 * estimate.sigma);
  EXPECT_EQ(estimate.given, 0.0);
  EXPECT_NEAR(estimate.change, 20.0, 1.0);
}

TEST_F(ReadoutTest, IsCorrectedWhereItIsTold) {
  const GlobalAdjustment found = adjust(0.02, 0.03);
  ASSERT_TRUE(found.calibration.has_value());
  EXPECT_NEAR(found.calibration->rig->cameras[0].readout_s, 0.02, 1e-3);
  EXPECT_NEAR(readout_of(found).given, 30.0, 1e-9);
}

TEST_F(ReadoutTest, FromTheBottomUpIsToBeGiven) {
  EXPECT_FALSE(adjust(-0.02, 0.0).calibration.has_value());
  const GlobalAdjustment found = adjust(-0.02, -0.03);
  ASSERT_TRUE(found.calibration.has_value());
  EXPECT_NEAR(found.calibration->rig->cameras[0].readout_s, -0.02, 1e-3);
}

TEST_F(ReadoutTest, OfAGlobalShutterIsLeftAlone) {
  EXPECT_FALSE(adjust(0.0, 0.0).calibration.has_value());
  EXPECT_FALSE(adjust(0.02, 0.02).calibration.has_value());
}

}  // namespace
}  // namespace waymark

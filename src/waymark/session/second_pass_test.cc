// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/second_pass.h"

#include <gmock/gmock.h>

#include "waymark/base/testing/temporary_folder.h"
#include "waymark/input/testing/images.h"

namespace waymark {
namespace {

using ::testing::IsEmpty;

CameraChain small_chain(double focal_px, double turn_rad = 0.0) {
  const CameraDescription camera{
      "pinhole", {focal_px, focal_px, 319.5, 239.5}, "radtan", {0.0, 0.0, 0.0, 0.0}, 640, 480, ""};
  const Rigid3 beside(so3_exp({0.0, turn_rad, 0.0}), Eigen::Vector3d(-0.1, 0.0, 0.0));
  return {{{camera, Rigid3()}, {camera, beside}}, 5000.0, {}};
}

Rig small_rig(double focal_px, double turn_rad = 0.0) {
  return make_rig(small_chain(focal_px, turn_rad));
}

TEST(ImageShift, IsThatOfTheCameraThatMovesMost) {
  EXPECT_NEAR(image_shift(small_rig(500.0), small_rig(500.0)), 0.0, 1e-9);
  // 10 % of the distance from the centre: 230 px, root mean square.
  EXPECT_NEAR(image_shift(small_rig(550.0), small_rig(495.0)), 0.1 * 230.0 / 640.0, 0.003);
  // Of the second camera all by 5 px, and a little more where that is far off the axis.
  EXPECT_NEAR(image_shift(small_rig(500.0), small_rig(500.0, 0.01)), 6.0 / 640.0, 0.001);
}

TEST(SecondPass, BeginsWithWhatWasFoundInsteadOfWhatWasStated) {
  const testing::TemporaryFolder folder;
  testing::write_image(folder / "images" / "0.png", 640, 480, 90.0);
  SessionOptions options;
  options.input = folder / "images";
  options.timing = Timing::kInline;
  CameraChain stated = small_chain(500.0);
  stated.cameras.resize(1);
  options.calibration = stated;
  Session session = open_session(options);
  EXPECT_FALSE(calibration_for_second_pass(session)) << "as stated";
  // As if 510 px had been stated and 500 px found: 2 %, which is mended in passing.
  session.rig.cameras = {small_rig(510.0).cameras[0]};
  EXPECT_FALSE(calibration_for_second_pass(session));
  session.rig.cameras = {small_rig(530.0).cameras[0]};
  const std::optional<SecondPass> found = calibration_for_second_pass(session);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->calibration.cameras[0].description.intrinsics[0], 500.0);
  EXPECT_EQ(found->calibration.depth_factor, 5000.0) << "what is not of the cameras stays";
}

TEST(JoinPasses, AddsTheChanges) {
  std::vector<CalibrationEstimate> first{{"cam0.fu", 50.0, 3.0, 0.1, 0.02},
                                         {"cam1.turn_y", 0.0, 2e-3, 5e-4, 1e-5}};
  std::vector<CalibrationEstimate> second{{"cam0.fu", 53.0, 0.5, 0.1, 0.01},
                                          {"cam1.turn_y", 0.0, 1e-4, 5e-4, 2e-5}};
  first.push_back({"readout_ms", 0.0, 20.0, 20.0, 1.0});
  const auto joined = join_passes(first, second);
  EXPECT_EQ(joined[0].given, 50.0);
  EXPECT_EQ(joined[0].change, 3.5);
  EXPECT_EQ(joined[0].sigma, 0.01);
  EXPECT_DOUBLE_EQ(joined[1].change, 2.1e-3);
  EXPECT_EQ(joined[2].change, 20.0) << "of the first alone";
  EXPECT_EQ(join_passes(first, {})[0].change, 3.0);
  EXPECT_THAT(join_passes({}, {}), IsEmpty());
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// A focal length that does not fit is found by its residuals.
#include <gtest/gtest.h>

#include <cmath>

#include "simulated_run.h"
#include "waymark/simulate/named_cameras.h"

namespace waymark {
namespace {

/// Maps 230 frames of a loop through the room with another calibration than that of the camera.
std::optional<FocalCheck> check_with(const CameraDescription& true_camera,
                                     const CameraDescription& camera) {
  SequenceSpec spec = small_sequence(Setup::kMono, 230);
  spec.motion = "loop";
  spec.chain = mono_chain(true_camera);
  Recording recording = simulate(spec);
  recording.rig = make_rig(mono_chain(camera));
  // What is off would be mended, and nothing be left to report.
  recording.settings.calibration.refine = "off";
  System system(recording.rig, recording.settings, Timing::kLockstep);
  for (const InputFrame& frame : recording.frames) {
    FrameImages input;
    input.timestamp_ns = frame.timestamp_ns;
    input.image0 = frame.images[0].view();
    system.feed(input);
    EXPECT_TRUE(frame.index >= 200 || system.focal_check() == nullptr);
  }
  system.finish();
  const FocalCheck* check = system.focal_check();
  return check == nullptr ? std::nullopt : std::optional(*check);
}

/// The same with the focal length wrong by a factor.
std::optional<FocalCheck> check_with(const char* name, double factor) {
  const CameraDescription true_camera = named_camera(name, 240);
  CameraDescription camera = true_camera;
  camera.intrinsics[0] *= factor;
  camera.intrinsics[1] *= factor;
  return check_with(true_camera, camera);
}

class FocalLength : public ::testing::TestWithParam<const char*> {};

TEST_P(FocalLength, ThatFitsIsLeftInPeace) {
  const std::optional<FocalCheck> check = check_with(GetParam(), 1.0);
  ASSERT_TRUE(check);
  EXPECT_LT(std::abs(check->factor - 1.0), 0.01);
  EXPECT_FALSE(check->is_off());
  EXPECT_FALSE(check->is_bent());
}

TEST_P(FocalLength, ThatIsOffIsReported) {
  const std::optional<FocalCheck> check = check_with(GetParam(), 1.04);
  ASSERT_TRUE(check);
  EXPECT_TRUE(check->is_off());
  EXPECT_NEAR(check->factor, 1.0 / 1.04, 0.02);
}

TEST_P(FocalLength, ThatIsFarOffIsReportedToo) {
  for (const double factor : {0.8, 1.2}) {
    const std::optional<FocalCheck> check = check_with(GetParam(), factor);
    ASSERT_TRUE(check) << factor;
    EXPECT_TRUE(check->is_off()) << factor;
    EXPECT_GT(std::log(check->factor) / std::log(1.0 / factor), 0.3) << factor;
  }
}

TEST(Distortion, ThatIsLeftOutIsReported) {
  CameraDescription camera = named_camera("perspective", 240);
  camera.distortion_model = "radtan";
  camera.distortion_coeffs = {-0.28, 0.07, 0.0, 0.0};
  EXPECT_FALSE(check_with(camera, camera).value().is_bent());
  CameraDescription ideal = camera;
  ideal.distortion_model = "none";
  ideal.distortion_coeffs.clear();
  const std::optional<FocalCheck> check = check_with(camera, ideal);
  ASSERT_TRUE(check);
  EXPECT_TRUE(check->is_bent() || check->is_off());
}

INSTANTIATE_TEST_SUITE_P(Cameras, FocalLength, ::testing::Values("perspective", "fisheye"));

}  // namespace
}  // namespace waymark

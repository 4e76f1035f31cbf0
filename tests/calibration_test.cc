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

/// Maps 230 frames of a loop through the room with the focal length wrong by a factor.
std::optional<FocalCheck> check_with(const char* name, double factor) {
  SequenceSpec spec = small_sequence(Setup::kMono, 230);
  spec.motion = "loop";
  spec.chain = mono_chain(named_camera(name, 240));
  Recording recording = simulate(spec);
  CameraDescription camera = spec.chain.cameras[0].description;
  camera.intrinsics[0] *= factor;
  camera.intrinsics[1] *= factor;
  recording.rig = make_rig(mono_chain(camera));
  System system(recording.rig, recording.settings, Timing::kLockstep);
  for (const InputFrame& frame : recording.frames) {
    FrameImages input;
    input.timestamp_ns = frame.timestamp_ns;
    input.image0 = frame.images[0].view();
    system.feed(input);
    EXPECT_TRUE(frame.index >= 200 || system.focal_check() == nullptr);
  }
  const FocalCheck* check = system.focal_check();
  return check == nullptr ? std::nullopt : std::optional(*check);
}

class FocalLength : public ::testing::TestWithParam<const char*> {};

TEST_P(FocalLength, ThatFitsIsLeftInPeace) {
  const std::optional<FocalCheck> check = check_with(GetParam(), 1.0);
  ASSERT_TRUE(check);
  EXPECT_LT(std::abs(check->factor - 1.0), 0.01);
  EXPECT_FALSE(check->is_off());
}

TEST_P(FocalLength, ThatIsOffIsReported) {
  const std::optional<FocalCheck> check = check_with(GetParam(), 1.04);
  ASSERT_TRUE(check);
  EXPECT_TRUE(check->is_off());
  EXPECT_NEAR(check->factor, 1.0 / 1.04, 0.02);
}

INSTANTIATE_TEST_SUITE_P(Cameras, FocalLength, ::testing::Values("perspective", "fisheye"));

}  // namespace
}  // namespace waymark

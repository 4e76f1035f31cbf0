// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/calibration_error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/base/check.h"
#include "waymark/simulate/named_cameras.h"
#include "waymark/simulate/sequence.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;

const Rigid3 kSpatialNeighbours(so3_exp({0.01, -0.02, 0.005}), {-0.11, 0.002, 0.001});

std::string error_of(const std::function<void()>& run) {
  try {
    run();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(CalibrationError, ChangesWhatItSaysAndNothingElse) {
  for (const std::string& name : camera_names()) {
    if (name == "equirectangular") continue;
    SCOPED_TRACE(name);
    const CameraDescription camera = named_camera(name, 480);
    const CameraChain told = told_chain(
        mono_chain(camera), parse_calibration_error({"focal=1.05", "centre=-5", "distortion=0.5"}));
    const CameraDescription& changed = told.cameras[0].description;
    const std::size_t first = camera.intrinsics.size() - 4;
    for (std::size_t i = 0; i < first; ++i) EXPECT_EQ(changed.intrinsics[i], camera.intrinsics[i]);
    for (std::size_t axis : {first, first + 1}) {
      EXPECT_DOUBLE_EQ(changed.intrinsics[axis], 1.05 * camera.intrinsics[axis]);
      EXPECT_DOUBLE_EQ(changed.intrinsics[axis + 2], camera.intrinsics[axis + 2] - 5.0);
    }
    for (std::size_t i = 0; i < camera.distortion_coeffs.size(); ++i) {
      EXPECT_EQ(changed.distortion_coeffs[i], 0.5 * camera.distortion_coeffs[i]);
    }
    EXPECT_NO_THROW(make_rig(told));
    EXPECT_NO_THROW(make_rig(told_chain(mono_chain(camera), {.distortion = 0.0})));
  }
}

TEST(CalibrationError, TurnsTheSecondCameraWhereItStands) {
  const CameraDescription camera = named_camera("perspective", 480);
  const CameraChain told = told_chain(stereo_chain(camera, camera, kSpatialNeighbours),
                                      parse_calibration_error({"turn_y=2"}));
  EXPECT_TRUE(told.cameras[0].description.is_same(camera));
  const Rigid3& turned = told.cameras[1].cam_from_rig;
  EXPECT_NEAR(turned.rotation.angularDistance(kSpatialNeighbours.rotation), 2e-3, 1e-9);
  const Eigen::Vector3d moved =
      turned.inverse().translation - kSpatialNeighbours.inverse().translation;
  EXPECT_LT(moved.norm(), 1e-12);
  const CameraChain longer =
      told_chain(stereo_chain(camera, camera, kSpatialNeighbours), {.baseline = 1000.0});
  EXPECT_LT(
      (longer.cameras[1].cam_from_rig.translation - 1000.0 * kSpatialNeighbours.translation).norm(),
      1e-9);
}

TEST(CalibrationError, ScalesDepth) {
  const CameraChain truth = rgbd_chain(named_camera("perspective", 480), 5000.0);
  EXPECT_DOUBLE_EQ(*told_chain(truth, parse_calibration_error({"depth=1.03"})).depth_factor,
                   5150.0);
}

TEST(CalibrationError, NamesWhatCannotBe) {
  for (const char* text : {"focal", "focal=", "focal=x", "fokal=1", "=1", ""}) {
    EXPECT_THAT(error_of([&] { parse_calibration_error({text}); }), HasSubstr("expected focal"))
        << text;
  }
  const CameraChain sphere = mono_chain(named_camera("equirectangular", 480));
  EXPECT_THAT(error_of([&] { told_chain(sphere, {.focal = 1.1}); }),
              HasSubstr("has neither focal length"));
  EXPECT_THAT(error_of([&] { told_chain(sphere, {.baseline = 2.0}); }), HasSubstr("one camera"));
  EXPECT_THAT(error_of([&] { told_chain(sphere, {.depth = 2.0}); }), HasSubstr("no depth"));
}

}  // namespace
}  // namespace waymark

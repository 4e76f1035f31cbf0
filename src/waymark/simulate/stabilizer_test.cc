// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/stabilizer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/simulate/named_cameras.h"
#include "waymark/simulate/sequence.h"

namespace waymark {
namespace {

constexpr double kRateHz = 20.0;
constexpr int kNumFrames = 60;
constexpr double kShare = 0.05;

/// Looks along z and shakes about all three axes, quickly or not at all.
Rigid3 shaking(int frame, double amplitude_rad) {
  const double phase = 2.0 * M_PI * 3.0 * frame / kRateHz;
  const Eigen::Vector3d turn(std::sin(phase), std::cos(phase), 0.3 * std::sin(phase + 1.0));
  return {so3_exp(amplitude_rad * turn), Eigen::Vector3d::Zero()};
}

class Stabilised : public ::testing::Test {
 protected:
  Stabilizer stabilizer(double amplitude_rad) const {
    return Stabilizer(
        picture_,
        [&](int frame) { return shaking(frame, amplitude_rad); },
        kNumFrames,
        kRateHz,
        kShare);
  }

  static Eigen::Vector2d project(const CameraDescription& camera, const Eigen::Vector3d& point) {
    const Rig rig = make_rig(mono_chain(camera));
    std::vector<Eigen::Vector2d> pixel(1);
    std::vector<std::uint8_t> is_visible(1);
    rig.cameras[0].camera->project(std::vector{point}, pixel, is_visible);
    EXPECT_EQ(is_visible[0], 1);
    return pixel[0];
  }

  /// Where a point is in a frame's picture.
  Eigen::Vector2d seen(const Stabilizer& stabilizer, int frame, const Eigen::Vector3d& in_cam) {
    const auto sensor_from_picture = stabilizer.sensor_from_picture(frame);
    const Eigen::Vector2d pixel = project(sensor_of(picture_, kShare), in_cam);
    return sensor_from_picture.leftCols<2>().inverse() * (pixel - sensor_from_picture.col(2));
  }

  CameraDescription picture_ = named_camera("perspective", 480);
};

TEST_F(Stabilised, ASteadyCameraHasTheDescribedPicture) {
  const Stabilizer steady = stabilizer(0.0);
  for (const Eigen::Vector3d& point : {Eigen::Vector3d(0.0, 0.0, 1.0), {0.5, -0.3, 1.0}}) {
    EXPECT_LT((seen(steady, 7, point) - project(picture_, point)).norm(), 1e-9);
  }
}

TEST_F(Stabilised, FarPointsHoldStill) {
  const double amplitude_rad = 0.01;
  const Stabilizer stabilizer = this->stabilizer(amplitude_rad);
  for (const Eigen::Vector3d& point : {Eigen::Vector3d(0.0, 0.0, 1.0), {0.2, -0.1, 1.0}}) {
    for (int frame = 20; frame < 40; ++frame) {
      const Eigen::Vector3d in_cam = shaking(frame, amplitude_rad).inverse() * point;
      const double off = (seen(stabilizer, frame, in_cam) - project(picture_, point)).norm();
      const double unsteady = (project(picture_, in_cam) - project(picture_, point)).norm();
      EXPECT_LT(off, 0.3 * unsteady) << frame;
    }
  }
}

TEST_F(Stabilised, ThePictureMovesNoFurtherThanAskedForAndStaysWithinTheSensor) {
  const Stabilizer stabilizer = this->stabilizer(0.2);
  double largest = 0.0;
  for (int frame = 0; frame < kNumFrames; ++frame) {
    const auto sensor_from_picture = stabilizer.sensor_from_picture(frame);
    const Eigen::Vector2d middle(0.5 * (picture_.width_px - 1), 0.5 * (picture_.height_px - 1));
    const Eigen::Vector2d shift = sensor_from_picture.leftCols<2>().inverse() *
                                  (sensor_from_picture * middle.homogeneous() - middle);
    EXPECT_LE(std::abs(shift.x()), kShare * picture_.width_px);
    EXPECT_LE(std::abs(shift.y()), kShare * picture_.height_px);
    largest = std::max(largest, std::abs(shift.x()));
    for (const double x : {0.0, picture_.width_px - 1.0}) {
      for (const double y : {0.0, picture_.height_px - 1.0}) {
        const Eigen::Vector2d pixel = sensor_from_picture * Eigen::Vector3d(x, y, 1.0);
        EXPECT_GE(pixel.minCoeff(), 0.0);
        EXPECT_LE(pixel.x(), picture_.width_px - 1.0);
        EXPECT_LE(pixel.y(), picture_.height_px - 1.0);
      }
    }
  }
  EXPECT_GT(largest, 0.8 * kShare * picture_.width_px);
}

TEST_F(Stabilised, PicturesOfASequenceAreCutFromTheSensors) {
  SequenceSpec spec;
  spec.motion = "shaken";
  spec.num_frames = 20;
  spec.chain = mono_chain(named_camera("perspective", 90));
  spec.stabilised_share = kShare;
  SimulatedSequence sequence(spec);
  SequenceSpec sensor = spec;
  sensor.stabilised_share = 0.0;
  sensor.chain = mono_chain(sensor_of(spec.chain.cameras[0].description, kShare));
  const Stabilizer stabilizer(
      spec.chain.cameras[0].description,
      [&](int frame) { return sequence.world_from_rig(frame); },
      spec.num_frames,
      spec.rate_hz,
      kShare);
  EXPECT_EQ(sequence.frame(9).images[0].values,
            stabilizer.stabilize(SimulatedSequence(sensor).frame(9).images[0], 9).values);
}

TEST_F(Stabilised, WantsAPlaneAndNoDepth) {
  SequenceSpec spec;
  spec.stabilised_share = kShare;
  spec.chain = mono_chain(named_camera("equirectangular", 90));
  EXPECT_THROW(SimulatedSequence{spec}, InputError);
  spec.chain = rgbd_chain(picture_, 5000.0);
  EXPECT_THROW(SimulatedSequence{spec}, InputError);
}

}  // namespace
}  // namespace waymark

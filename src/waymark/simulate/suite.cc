// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <numbers>

#include "waymark/geometry/rigid3.h"
#include "waymark/simulate/dataset.h"

namespace waymark {
namespace {

constexpr double kRadPerDegree = std::numbers::pi / 180.0;
constexpr double kDepthFactor = 5000.0;

CameraDescription pinhole(int width_px, int height_px, double focal_px) {
  CameraDescription camera;
  camera.camera_model = "pinhole";
  camera.intrinsics = {focal_px, focal_px, 0.5 * width_px - 0.5, 0.5 * height_px - 0.5};
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.where = "simulated camera";
  return camera;
}

/// A wide lens as of small stereo sensors; index 0 or 1 tells the two of a pair apart.
CameraDescription distorted(int index) {
  const double sign = index == 0 ? 1.0 : -1.0;
  CameraDescription camera = pinhole(512, 384, 320.0 + 3.0 * sign);
  camera.intrinsics[2] += 7.0 * sign;
  camera.intrinsics[3] -= 5.0 * sign;
  camera.distortion_model = "radtan";
  camera.distortion_coeffs = {-0.28 + 0.005 * sign, 0.074, 0.0002 * sign, -0.0001};
  return camera;
}

/// Cameras side by side, camera 1 to the right, turned by a rotation vector in degrees.
Rigid3 beside(double baseline_m, const Eigen::Vector3d& turn_deg) {
  const Eigen::Quaterniond cam1_from_cam0 = so3_exp(-kRadPerDegree * turn_deg);
  return {cam1_from_cam0, -(cam1_from_cam0 * Eigen::Vector3d(baseline_m, 0.0, 0.0))};
}

CameraChain plain_mono() { return mono_chain(pinhole(640, 480, 420.0)); }

CameraChain parallel_stereo(double baseline_m) {
  const CameraDescription camera = pinhole(512, 384, 340.0);
  return stereo_chain(camera, camera, beside(baseline_m, Eigen::Vector3d::Zero()));
}

CameraChain verged_stereo(double baseline_m) {
  return stereo_chain(distorted(0), distorted(1), beside(baseline_m, {1.0, -5.0, 1.5}));
}

CameraChain plain_rgbd() { return rgbd_chain(pinhole(640, 480, 500.0), kDepthFactor); }

SequenceSpec sequence(const char* name,
                      const char* world,
                      const char* motion,
                      std::uint64_t seed,
                      CameraChain chain) {
  SequenceSpec spec;
  spec.name = name;
  spec.world = world;
  spec.motion = motion;
  spec.seed = seed;
  spec.num_frames = 300;
  spec.effects.noise_sigma = 2.0;
  spec.effects.exposure_s = 0.004;
  if (chain.depth_factor) spec.effects.inverse_depth_sigma = 0.0015;
  spec.chain = std::move(chain);
  return spec;
}

/// The exposure jumps to a sixth, recovers, jumps to three times; then two seconds of dark, noisy
/// images.
SequenceSpec with_changing_light(SequenceSpec spec) {
  const auto add = [&](int first, int end, double gain, double noise_sigma) {
    ImageEffects effects = spec.effects;
    effects.gain = gain;
    effects.noise_sigma = noise_sigma;
    spec.spans.push_back({first, end, effects});
  };
  add(60, 75, 1.0 / 6.0, 2.0);
  add(75, 90, 0.5, 2.0);
  add(130, 145, 3.0, 2.0);
  add(145, 160, 1.6, 2.0);
  add(200, 240, 0.22, 5.0);
  return spec;
}

}  // namespace

std::vector<SuiteEntry> simulated_suite() {
  return {
      {sequence("mono_room", "room", "loop", 101, plain_mono()),
       "mono",
       "once around a table, looking about"},
      {sequence("mono_street", "street", "loop", 102, plain_mono()),
       "mono",
       "a car once around a block"},
      {sequence("stereo_apartment", "apartment", "loop", 103, parallel_stereo(0.12)),
       "stereo",
       "through four rooms and back"},
      {sequence("stereo_street", "street", "loop", 104, parallel_stereo(0.5)),
       "stereo",
       "a car once around a block"},
      {sequence("verged_room", "room", "inspect", 105, verged_stereo(0.1)),
       "stereo",
       "hand-held, unrectified, distorted, verged by 5 degrees"},
      {sequence("verged_hall", "hall", "loop", 106, verged_stereo(0.25)),
       "stereo",
       "around a hall; unrectified, distorted, verged by 5 degrees"},
      {sequence("rgbd_room", "room", "inspect", 107, plain_rgbd()), "rgbd", "hand-held"},
      {sequence("rgbd_apartment", "apartment", "loop", 108, plain_rgbd()),
       "rgbd",
       "through four rooms and back"},
      {sequence("hard_turns", "hall", "fast_turn", 109, plain_mono()),
       "mono",
       "quick turns of the head by 75 degrees"},
      {with_changing_light(sequence("hard_light", "apartment", "inspect", 110, plain_mono())),
       "mono",
       "exposure jumps by 1/6 and 3, two seconds dark and noisy"},
  };
}

}  // namespace waymark

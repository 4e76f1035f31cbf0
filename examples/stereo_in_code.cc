// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// A stereo pair and settings without any file: describes the cameras in code, and maps images that
// are simulated in memory, whose true poses are known.
//
//   waymark_example_stereo_in_code [NUM_FRAMES]
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <vector>

#include "waymark/camera/camchain.h"
#include "waymark/evaluate/evaluation.h"
#include "waymark/simulate/sequence.h"
#include "waymark/system/system.h"

namespace {

using namespace waymark;

/// The same as a camchain file: what each camera is, and how the second stands to the first.
CameraChain describe_pair() {
  CameraDescription camera;
  camera.camera_model = "pinhole";
  camera.intrinsics = {290.0, 291.0, 187.0, 121.0};  // fu fv pu pv, in px.
  camera.distortion_model = "radtan";
  camera.distortion_coeffs = {-0.2, 0.05, 0.0002, -0.0001};
  camera.width_px = 376;
  camera.height_px = 240;
  camera.where = "stereo_in_code";  // How error messages begin.

  // Points of camera 0 in the frame of camera 1, which is 20 cm to the right of camera 0: what is
  // straight ahead of camera 0 is to the left of camera 1.
  const Rigid3 cam1_from_cam0(Eigen::Quaterniond::Identity(), {-0.2, 0.0, 0.0});

  CameraChain chain;
  chain.cameras = {{camera, Rigid3()}, {camera, cam1_from_cam0}};
  return chain;
}

int map_simulated(int num_frames) {
  SequenceSpec spec;
  spec.world = "room";
  spec.motion = "inspect";
  spec.chain = describe_pair();
  spec.num_frames = num_frames;
  SimulatedSequence sequence(spec);

  Settings settings;  // What `waymark config` prints, with its defaults.
  settings.features.count = 800;
  settings.seed = 1;
  System system(make_rig(spec.chain), settings, Timing::kInline);

  std::vector<StampedPose> truth;
  for (int i = 0; i < num_frames; ++i) {
    const SimulatedFrame simulated = sequence.frame(i);
    truth.push_back({simulated.timestamp_ns, simulated.world_from_rig});
    FrameImages frame;
    frame.timestamp_ns = simulated.timestamp_ns;
    frame.image0 = simulated.images[0].view();
    frame.image1 = simulated.images[1].view();  // With depth images it would be frame.depth.
    system.feed(frame);
  }
  system.finish();

  std::vector<StampedPose> estimate;
  for (const TrajectoryFrame& frame : system.trajectory()) {
    estimate.push_back({frame.timestamp_ns, frame.world_from_rig});
  }
  EvaluationOptions options;
  options.alignment = TrajectoryAlignment::kSe3;  // The worlds differ, the metres are the same.
  options.num_frames = truth.size();
  const Evaluation evaluation = evaluate(estimate, truth, options);
  std::printf("%zu of %d frames, %.1f mm off over %.2f m\n",
              estimate.size(),
              num_frames,
              1e3 * evaluation.ate_m.rmse,
              evaluation.path_length_m);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return map_simulated(argc > 1 ? std::atoi(argv[1]) : 40);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}

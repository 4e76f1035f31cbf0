// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Cameras of one's own: registers two models, makes the camera that a settings file names,
// simulates a sequence with it and maps that.
//
//   custom_camera SETTINGS.yaml [LARGEST_ERROR_M]
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <optional>
#include <vector>

#include "dual_fisheye_camera.h"
#include "mirror_camera.h"
#include "waymark/base/check.h"
#include "waymark/base/config.h"
#include "waymark/camera/camchain.h"
#include "waymark/evaluate/evaluation.h"
#include "waymark/simulate/sequence.h"
#include "waymark/system/system.h"

namespace {

using namespace waymark;

SequenceSpec hand_held(const CameraChain& chain) {
  SequenceSpec spec;
  spec.name = spec.world = "room";
  spec.motion = "inspect";
  spec.chain = chain;
  spec.num_frames = 60;
  spec.effects.noise_sigma = 2.0;
  return spec;
}

Evaluation map_simulated(SimulatedSequence& sequence, const Settings& settings) {
  System system(sequence.rig(), settings, Timing::kLockstep);
  std::vector<StampedPose> truth;
  for (int i = 0; i < sequence.num_frames(); ++i) {
    const SimulatedFrame frame = sequence.frame(i);
    truth.push_back({frame.timestamp_ns, frame.world_from_rig});
    FrameImages input;
    input.timestamp_ns = frame.timestamp_ns;
    input.image0 = frame.images[0].view();
    system.feed(input);
  }
  system.finish();
  std::vector<StampedPose> estimate;
  for (const TrajectoryFrame& pose : system.trajectory()) {
    estimate.push_back({pose.timestamp_ns, pose.world_from_rig});
  }
  EvaluationOptions options;
  options.alignment = TrajectoryAlignment::kSim3;  // One camera does not know the scale.
  options.num_frames = truth.size();
  return evaluate(estimate, truth, options);
}

int run(const char* settings_file, double largest_error_m) {
  CameraRegistry registry = CameraRegistry::with_builtin_models();
  MirrorModel::add_to(registry);
  DualFisheyeCamera::add_to(registry);

  const ConfigNode config = parse_config(ConfigSource::from_file(settings_file));
  Settings settings;
  read_settings(settings, config);
  const std::optional<CameraChain> chain = read_camchain(config);
  if (!chain) throw InputError(settings_file, "describes no camera, expected cam0");

  SimulatedSequence sequence(hand_held(*chain), 2, registry);
  const Evaluation evaluation = map_simulated(sequence, settings);
  std::printf("%s: coverage %.3f, ATE %.4f m over %.1f m\n",
              chain->cameras[0].description.camera_model.c_str(),
              evaluation.coverage,
              evaluation.ate_m.rmse,
              evaluation.path_length_m);
  return evaluation.coverage >= 0.95 && evaluation.ate_m.rmse <= largest_error_m ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: %s SETTINGS.yaml [LARGEST_ERROR_M]\n", argv[0]);
    return 2;
  }
  try {
    return run(argv[1], argc > 2 ? std::atof(argv[2]) : 1.0);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 2;
  }
}

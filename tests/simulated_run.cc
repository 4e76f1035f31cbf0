// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "simulated_run.h"

#include <bit>
#include <cmath>
#include <optional>
#include <thread>
#include <utility>

#include "waymark/simulate/render.h"

namespace waymark {
namespace {

CameraDescription small_camera() {
  CameraDescription camera;
  camera.camera_model = "pinhole";
  camera.intrinsics = {290.0, 291.0, 187.0, 121.0};
  camera.distortion_model = "radtan";
  camera.distortion_coeffs = {-0.2, 0.05, 0.0002, -0.0001};
  camera.width_px = 376;
  camera.height_px = 240;
  camera.where = "small camera";
  return camera;
}

CameraChain small_chain(Setup setup) {
  if (setup == Setup::kMono) return mono_chain(small_camera());
  if (setup == Setup::kRgbd) return rgbd_chain(small_camera(), kDepthFactor);
  Vector6d cam1_from_cam0;
  cam1_from_cam0 << -0.2, 0.003, -0.002, 0.01, -0.012, 0.006;
  return stereo_chain(small_camera(), small_camera(), Rigid3::exp(cam1_from_cam0));
}

/// Gives the frames of a recording one by one.
class RecordingInput : public Input {
 public:
  explicit RecordingInput(const Recording& recording) : recording_(recording) {
    info_.format = "memory";
    info_.setup = recording.setup;
    info_.num_frames = recording.frames.size();
  }

  const InputInfo& info() const override { return info_; }

  std::optional<InputFrame> next() override {
    if (next_ == recording_.frames.size()) return std::nullopt;
    return recording_.frames[next_++];
  }

 private:
  const Recording& recording_;
  InputInfo info_;
  std::size_t next_ = 0;
};

/// FNV-1a, 64 bits.
class Hash {
 public:
  void add(std::uint64_t word) {
    for (int i = 0; i < 8; ++i) {
      value_ = (value_ ^ (word & 0xff)) * 0x100000001b3;
      word >>= 8;
    }
  }
  void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
  void add(const StampedPose& pose) {
    add(static_cast<std::uint64_t>(pose.timestamp_ns));
    for (double value : pose.world_from_camera.rotation.coeffs()) add(value);
    for (double value : pose.world_from_camera.translation) add(value);
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325;
};

}  // namespace

SequenceSpec small_sequence(Setup setup, int num_frames) {
  SequenceSpec spec;
  spec.name = "small";
  spec.world = "room";
  spec.motion = "inspect";
  spec.chain = small_chain(setup);
  spec.num_frames = num_frames;
  spec.effects.noise_sigma = 2.0;
  if (setup == Setup::kRgbd) spec.effects.inverse_depth_sigma = 0.002;
  return spec;
}

Recording simulate(const SequenceSpec& spec) {
  SimulatedSequence sequence(spec, std::thread::hardware_concurrency());
  Recording recording;
  const CameraChain told = told_chain(spec.chain, spec.told);
  recording.rig = make_rig(told);
  recording.setup = spec.chain.depth_factor         ? Setup::kRgbd
                    : spec.chain.cameras.size() > 1 ? Setup::kStereo
                                                    : Setup::kMono;
  if (told.depth_factor) recording.settings.depth.factor = *told.depth_factor;
  for (int i = 0; i < sequence.num_frames(); ++i) {
    SimulatedFrame simulated = sequence.frame(i);
    InputFrame frame;
    frame.index = static_cast<std::size_t>(i);
    frame.timestamp_ns = simulated.timestamp_ns;
    frame.images = std::move(simulated.images);
    if (spec.chain.depth_factor) frame.depth = std::move(simulated.depth);
    recording.frames.push_back(std::move(frame));
    recording.groundtruth.push_back({simulated.timestamp_ns, simulated.world_from_rig});
  }
  return recording;
}

Recording simulate(const CameraDescription& camera, const Motion& motion) {
  constexpr double kRateHz = 20.0;
  Recording recording;
  recording.rig = make_rig(mono_chain(camera));
  const Renderer renderer(make_world("room", 0), recording.rig.cameras[0].camera);
  ThreadPool pool(std::thread::hardware_concurrency());
  const int num_frames = static_cast<int>(motion.duration_s() * kRateHz);
  for (int i = 0; i < num_frames; ++i) {
    const Rigid3 world_from_rig = motion.world_from_rig(i / kRateHz);
    InputFrame frame;
    frame.index = static_cast<std::size_t>(i);
    frame.timestamp_ns = std::llround(1e9 * i / kRateHz);
    frame.images.push_back(renderer.image(world_from_rig, pool));
    recording.groundtruth.push_back({frame.timestamp_ns, world_from_rig});
    recording.frames.push_back(std::move(frame));
  }
  return recording;
}

SessionResults map_recording(const Recording& recording, Timing timing) {
  RecordingInput input(recording);
  System system(recording.rig, recording.settings, timing);
  return run_session(input, system);
}

double coverage(const SessionResults& results) {
  const RunSummary& summary = results.summary;
  return static_cast<double>(summary.num_trajectory_lines) /
         static_cast<double>(summary.counts.frames);
}

Evaluation evaluate_results(const SessionResults& results, const Recording& recording) {
  EvaluationOptions options;
  options.alignment =
      recording.setup == Setup::kMono ? TrajectoryAlignment::kSim3 : TrajectoryAlignment::kSe3;
  options.num_frames = recording.frames.size();
  return evaluate(results.trajectories.at(0), recording.groundtruth, options);
}

std::uint64_t hash_of(const SessionResults& results) {
  Hash hash;
  for (const std::vector<StampedPose>& trajectory : results.trajectories) {
    for (const StampedPose& pose : trajectory) hash.add(pose);
  }
  for (const StampedPose& pose : results.keyframes) hash.add(pose);
  hash.add(static_cast<std::uint64_t>(results.summary.landmarks));
  return hash.value();
}

}  // namespace waymark

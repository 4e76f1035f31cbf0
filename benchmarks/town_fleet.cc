// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Recordings of one town for a fleet, each mapped by itself, feature by feature:
//   waymark_town_fleet NUM_RECORDINGS KEYFRAMES_EACH FOLDER
// FOLDER/NN.wmap is the map of a recording after its own loops, FOLDER/NN.txt the true way of its
// rig (TUM). Three rigs take turns; each recording begins elsewhere, goes its own way and has
// its own light. The town grows with the number of recordings. benchmarks/town_fleet.py uses it.
#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "waymark/camera/registry.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/results/trajectory.h"
#include "waymark/simulate/named_cameras.h"
#include "waymark/simulate/testing/town_map.h"
#include "waymark/simulate/testing/town_session.h"

namespace waymark {
namespace {

/// A metre from each other; about one of nine stays a keyframe.
constexpr std::size_t kFramesPerKeyframe = 9;
constexpr int kNumRigs = 3;
/// Recordings are so far apart in time.
constexpr std::int64_t kBetweenNs = 100'000'000'000'000;

std::shared_ptr<const Rig> make_rig_of(const CameraDescription& description, int num_cameras) {
  const auto camera = CameraRegistry::with_builtin_models().make_camera(description);
  Rig rig;
  for (int i = 0; i < num_cameras; ++i) {
    const Rigid3 beside(Eigen::Quaterniond::Identity(), {-0.6 * i, 0.0, 0.0});
    rig.cameras.push_back({camera, beside, description});
  }
  return std::make_shared<const Rig>(std::move(rig));
}

/// A camera with depth of 640 x 480 pixels, a pair of 1280 x 960, a fisheye with depth of
/// 800 x 800.
std::shared_ptr<const Rig> make_rig_of_fleet(std::size_t recording) {
  switch (recording % kNumRigs) {
    case 0:
      return make_town_rig(1);
    case 1:
      return make_rig_of(named_camera("perspective", 960), 2);
    default:
      return make_rig_of(named_camera("fisheye", 800), 1);
  }
}

TownRecording make_recording_of_fleet(const std::shared_ptr<const Town>& town,
                                      const std::shared_ptr<const Rig>& rig,
                                      std::size_t keyframes_each,
                                      std::size_t recording) {
  constexpr int kNumLights = 4;
  const auto light = static_cast<double>(recording % kNumLights) / kNumLights;
  TownRecordingSettings settings;
  settings.seed = 2 + recording;
  settings.num_frames = static_cast<std::uint32_t>(kFramesPerKeyframe * keyframes_each);
  settings.step_m = 1.0;
  settings.light_flips = 0.08 * light;
  settings.light_dropout = 0.4 * light;
  settings.max_features = 400;
  if (rig->cameras.size() == 1) settings.inverse_range_sigma = 0.002;
  return {town, rig, settings};
}

void write_truth(const std::filesystem::path& path,
                 const TownRecording& recording,
                 std::int64_t first_ns) {
  std::vector<StampedPose> truth;
  for (std::uint32_t i = 0; i < recording.num_frames(); ++i) {
    truth.push_back({first_ns + TownSession::kFramePeriodNs * i, recording.world_from_rig(i)});
  }
  write_trajectory(path, truth, TrajectoryFormat::kTum);
}

void record(const std::shared_ptr<const Town>& town,
            std::size_t keyframes_each,
            std::size_t number,
            const std::filesystem::path& folder) {
  const std::shared_ptr<const Rig> rig = make_rig_of_fleet(number);
  const TownRecording recording = make_recording_of_fleet(town, rig, keyframes_each, number);
  const std::int64_t first_ns = kBetweenNs * static_cast<std::int64_t>(number + 1);
  TownSession session(rig, true, first_ns);
  std::uint32_t num_tracked = 0;
  for (std::uint32_t frame = 0; frame < recording.num_frames(); ++frame) {
    num_tracked += session.track(recording.frame(frame)).world_from_rig.has_value();
  }
  session.finish();
  const std::string name = fmt::format("{:02}", number);
  write_truth(folder / (name + ".txt"), recording, first_ns);
  save_map(folder / (name + ".wmap"),
           {.map = session.snapshot().map, .settings = {}, .images = {}});
  fmt::print("{}: {} keyframes, {} loops, {} of {} frames tracked\n",
             name,
             session.map().keyframes().size(),
             session.num_loops(),
             num_tracked,
             recording.num_frames());
  std::fflush(stdout);
}

void run(std::size_t num_recordings,
         std::size_t keyframes_each,
         const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  const std::shared_ptr<const Town> town = make_town_for(
      {.num_keyframes = kFramesPerKeyframe * keyframes_each * num_recordings, .num_passes = 8.0});
  for (std::size_t i = 0; i < num_recordings; ++i) record(town, keyframes_each, i, folder);
}

}  // namespace
}  // namespace waymark

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: %s NUM_RECORDINGS KEYFRAMES_EACH FOLDER\n", argv[0]);
    return 2;
  }
  try {
    waymark::run(std::strtoul(argv[1], nullptr, 10), std::strtoul(argv[2], nullptr, 10), argv[3]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}

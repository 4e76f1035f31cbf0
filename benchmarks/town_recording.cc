// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// A recording of a town from its first frame to the end of its map, feature by feature, as JSON:
//   waymark_town_recording ABOUT_KEYFRAMES [MAX_MEMORY_GB FOLDER]
// Processor time of tracking and mapping by tenths of the way, of adjusting everything, of what
// follows the last frame; the peak of memory; errors; and a number that two runs with the same
// results have in common. Making the frames is not counted.
#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <string>
#include <vector>

#include "memory.h"
#include "waymark/base/check.h"
#include "waymark/base/disk_memory.h"
#include "waymark/simulate/testing/town_map.h"
#include "waymark/simulate/testing/town_session.h"

namespace waymark {
namespace {

/// Frames, a metre from each other, until about one of them stays a keyframe.
constexpr std::size_t kFramesPerKeyframe = 6;
constexpr std::size_t kNumParts = 10;

struct PartOfWay {
  std::vector<double> track_ms, map_ms;
};

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

double high(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 95 / 100);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Of the poses of all keyframes.
std::uint64_t fingerprint(const Map& map) {
  std::uint64_t hash = 14695981039346656037u;  // FNV-1a, by words.
  const auto add = [&](std::uint64_t word) { hash = (hash ^ word) * 1099511628211u; };
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    add(id.value);
    for (const double value : keyframe.rig_from_world.translation) {
      add(std::bit_cast<std::uint64_t>(value));
    }
  });
  return hash;
}

/// Root mean square of the positions of keyframes after alignment, in metres.
double error_of(const Map& map, const TownRecording& recording) {
  std::vector<Eigen::Vector3d> found;
  std::vector<Eigen::Vector3d> truth;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    found.push_back(keyframe.rig_from_world.inverse().translation);
    truth.push_back(recording.world_from_rig(keyframe.frame.value).translation);
  });
  Eigen::Matrix3Xd from(3, found.size());
  Eigen::Matrix3Xd to(3, truth.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    from.col(static_cast<Eigen::Index>(i)) = found[i];
    to.col(static_cast<Eigen::Index>(i)) = truth[i];
  }
  const Eigen::Matrix4d to_from_from = Eigen::umeyama(from, to, false);
  const Eigen::Matrix3Xd moved =
      (to_from_from.topLeftCorner<3, 3>() * from).colwise() + to_from_from.topRightCorner<3, 1>();
  return std::sqrt((moved - to).squaredNorm() / static_cast<double>(found.size()));
}

void print_parts(const char* name, const std::vector<PartOfWay>& parts) {
  std::printf("  \"%s\": [", name);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    std::printf("%s[%.2f, %.2f, %.2f]",
                i == 0 ? "" : ", ",
                mean(parts[i].track_ms),
                mean(parts[i].map_ms),
                high(parts[i].map_ms));
  }
  std::printf("],\n");
}

void run(std::size_t num_keyframes, std::shared_ptr<std::pmr::memory_resource> memory) {
  const TownMapSettings settings{.num_keyframes = kFramesPerKeyframe * num_keyframes};
  const std::shared_ptr<const Town> town = make_town_for(settings);
  const std::shared_ptr<const Rig> rig = make_town_rig(1);
  const TownRecording recording = make_town_recording(town, rig, settings, 0);
  TownSession session(rig, true);
  if (memory) session.keep_in(memory);
  const double before_mb = memory_mb("VmRSS");

  std::vector<PartOfWay> parts(kNumParts);
  double adjust_s = 0.0;
  double longest_loop_s = 0.0;
  int num_adjustments = 0;
  std::uint32_t num_tracked = 0;
  for (std::uint32_t frame = 0; frame < recording.num_frames(); ++frame) {
    const int num_loops = session.num_loops();
    num_tracked += session.track(recording.frame(frame)).world_from_rig.has_value();
    const TownSession::Times& times = session.times();
    PartOfWay& part = parts[std::size_t{frame} * kNumParts / recording.num_frames()];
    part.track_ms.push_back(1e3 * times.track_s);
    if (times.map_s > 0.0) part.map_ms.push_back(1e3 * times.map_s);
    adjust_s += times.adjust_s;
    num_adjustments += times.adjust_s > 0.0;
    if (session.num_loops() > num_loops) longest_loop_s = std::max(longest_loop_s, times.map_s);
  }
  const std::clock_t end = std::clock();
  session.finish();
  const double end_s = static_cast<double>(std::clock() - end) / CLOCKS_PER_SEC;

  const Map& map = session.map();
  std::printf("{\n  \"keyframes\": %zu,\n", map.keyframes().size());
  std::printf("  \"tracked\": %.4f,\n",
              static_cast<double>(num_tracked) / static_cast<double>(recording.num_frames()));
  std::printf("  \"loops\": %d,\n", session.num_loops());
  print_parts("track_mean_map_mean_map_p95_ms", parts);
  std::printf("  \"longest_loop_s\": %.2f,\n", longest_loop_s);
  std::printf("  \"adjustments\": %d,\n  \"adjust_s\": %.1f,\n", num_adjustments, adjust_s);
  std::printf("  \"end_s\": %.1f,\n", end_s);
  std::printf("  \"ate_m\": %.4f,\n", error_of(map, recording));
  std::printf(
      "  \"peak_kb_per_keyframe\": %.0f,\n",
      1024.0 * (memory_mb("VmHWM") - before_mb) / static_cast<double>(map.keyframes().size()));
  std::printf("  \"fingerprint\": \"%016llx\"\n}\n",
              static_cast<unsigned long long>(fingerprint(map)));
}

}  // namespace
}  // namespace waymark

int main(int argc, char** argv) {
  if (argc != 2 && argc != 4) {
    std::fprintf(stderr, "usage: %s ABOUT_KEYFRAMES [MAX_MEMORY_GB FOLDER]\n", argv[0]);
    return 2;
  }
  try {
    std::shared_ptr<std::pmr::memory_resource> memory;
    if (argc == 4) {
      memory = std::make_shared<waymark::DiskMemory>(
          argv[3], static_cast<std::size_t>(1e9 * std::atof(argv[2])));
    }
    waymark::run(static_cast<std::size_t>(std::atoll(argv[1])), std::move(memory));
  } catch (const waymark::OutputError& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}

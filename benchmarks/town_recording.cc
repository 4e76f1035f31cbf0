// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// A recording of a town from its first frame to the end of its map, feature by feature, as JSON:
//   waymark_town_recording ABOUT_KEYFRAMES [MAX_MEMORY_GB FOLDER]
// Processor time of tracking and mapping by tenths of the way, of keyframes that close a loop, of
// adjusting everything, of what follows the last frame and of writing the map; memory, the peak
// and the mean over the way; errors; and a number that two runs with the same results have in
// common. Making the frames is not counted. What is known so far goes to stderr fifty times on the
// way.
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "memory.h"
#include "waymark/base/check.h"
#include "waymark/base/disk_memory.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/simulate/testing/town_map.h"
#include "waymark/simulate/testing/town_session.h"

namespace waymark {
namespace {

/// Frames, a metre from each other, until about one of them stays a keyframe.
constexpr std::size_t kFramesPerKeyframe = 6;
constexpr std::uint32_t kNumParts = 10;
constexpr std::uint32_t kNumLooks = 50;

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

/// The value below which so many per cent are.
double percentile(std::vector<double> values, std::size_t per_cent) {
  if (values.empty()) return 0.0;
  const std::size_t rank = std::min(values.size() * per_cent / 100, values.size() - 1);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

struct PartOfWay {
  std::vector<double> track_ms, map_ms, loop_ms;
};

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

/// Mean, median, p95 and the longest.
void print_times(const std::vector<double>& times_ms) {
  std::printf("[%.2f, %.2f, %.2f, %.2f]",
              mean(times_ms),
              percentile(times_ms, 50),
              percentile(times_ms, 95),
              percentile(times_ms, 100));
}

void print_parts(const std::vector<PartOfWay>& parts) {
  std::printf("  \"mean_median_p95_longest_ms\": [\n");
  for (const PartOfWay& part : parts) {
    std::printf("    {\"track\": ");
    print_times(part.track_ms);
    std::printf(", \"map\": ");
    print_times(part.map_ms);
    std::printf(", \"loops\": %zu, \"loop\": ", part.loop_ms.size());
    print_times(part.loop_ms);
    std::printf("}%s\n", &part == &parts.back() ? "" : ",");
  }
  std::printf("  ],\n");
}

/// Processor time of all threads and time by the clock, in seconds.
class Stopwatch {
 public:
  double cpu_s() const { return static_cast<double>(std::clock() - cpu_) / CLOCKS_PER_SEC; }
  double clock_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - clock_).count();
  }

 private:
  std::clock_t cpu_ = std::clock();
  std::chrono::steady_clock::time_point clock_ = std::chrono::steady_clock::now();
};

/// A session that goes the way from its first frame to the end, and what it took.
class MeasuredSession {
 public:
  MeasuredSession(const TownRecording& recording,
                  const std::shared_ptr<const Rig>& rig,
                  const std::shared_ptr<std::pmr::memory_resource>& memory)
      : recording_(recording), session_(rig, true), parts_(kNumParts) {
    if (memory) session_.keep_in(memory);
  }

  void go_the_way() {
    const std::uint32_t frames_per_look = std::max(recording_.num_frames() / kNumLooks, 1u);
    for (std::uint32_t frame = 0; frame < recording_.num_frames(); ++frame) {
      go_on(frame);
      if ((frame + 1) % frames_per_look == 0) look_at_memory(frame + 1);
    }
  }

  void print_the_way() const {
    std::printf("  \"tracked\": %.4f,\n",
                static_cast<double>(num_tracked_) / static_cast<double>(recording_.num_frames()));
    std::printf("  \"loops\": %d,\n", session_.num_loops());
    print_parts(parts_);
    std::printf("  \"adjustments\": %d,\n  \"adjust_s\": %.1f,\n", num_adjustments_, adjust_s_);
    std::printf("  \"mean_kb_per_keyframe\": %.0f,\n", mean(kb_per_keyframe_));
  }

  /// What follows the last frame: adjusts everything and writes the map.
  void finish() {
    const Stopwatch adjusting;
    session_.finish();
    std::printf("  \"end_cpu_clock_s\": [%.1f, %.1f],\n", adjusting.cpu_s(), adjusting.clock_s());
    const std::filesystem::path file = std::filesystem::temp_directory_path() /
                                       ("waymark_town_recording." + std::to_string(getpid()));
    const Stopwatch writing;
    save_map(file, {.map = session_.snapshot().map, .settings = {}, .images = {}});
    std::printf("  \"write_cpu_clock_s\": [%.1f, %.1f],\n", writing.cpu_s(), writing.clock_s());
    std::filesystem::remove(file);
  }

  /// Of a whole process by keyframe, without what it had before.
  double kb_per_keyframe(const std::string& key) const {
    return 1024.0 * (memory_mb(key) - before_mb_) / static_cast<double>(map().keyframes().size());
  }

  const Map& map() const { return session_.map(); }

 private:
  void go_on(std::uint32_t frame) {
    const int num_loops = session_.num_loops();
    num_tracked_ += session_.track(recording_.frame(frame)).world_from_rig.has_value();
    const TownSession::Times& times = session_.times();
    PartOfWay& part = parts_[std::size_t{frame} * kNumParts / recording_.num_frames()];
    part.track_ms.push_back(1e3 * times.track_s);
    if (times.map_s > 0.0) part.map_ms.push_back(1e3 * times.map_s);
    if (session_.num_loops() > num_loops) part.loop_ms.push_back(1e3 * times.map_s);
    adjust_s_ += times.adjust_s;
    num_adjustments_ += times.adjust_s > 0.0;
  }

  void look_at_memory(std::uint32_t num_frames) {
    kb_per_keyframe_.push_back(kb_per_keyframe("VmRSS"));
    const PartOfWay& part =
        parts_[std::size_t{num_frames - 1} * kNumParts / recording_.num_frames()];
    std::fprintf(stderr,
                 "%u frames, %zu keyframes, %d loops; of this tenth p95: track %.2f ms, map %.2f "
                 "ms; adjusting %.1f s so far; %.0f kB per keyframe, %.0f MB at most\n",
                 num_frames,
                 map().keyframes().size(),
                 session_.num_loops(),
                 percentile(part.track_ms, 95),
                 percentile(part.map_ms, 95),
                 adjust_s_,
                 kb_per_keyframe_.back(),
                 memory_mb("VmHWM"));
  }

  const TownRecording& recording_;
  const double before_mb_ = memory_mb("VmRSS");
  TownSession session_;
  std::vector<PartOfWay> parts_;
  std::vector<double> kb_per_keyframe_;  ///< One per look on the way.
  double adjust_s_ = 0.0;
  int num_adjustments_ = 0;
  std::uint32_t num_tracked_ = 0;
};

void run(std::size_t num_keyframes, const std::shared_ptr<std::pmr::memory_resource>& memory) {
  const TownMapSettings settings{.num_keyframes = kFramesPerKeyframe * num_keyframes};
  const std::shared_ptr<const Town> town = make_town_for(settings);
  const std::shared_ptr<const Rig> rig = make_town_rig(1);
  const TownRecording recording = make_town_recording(town, rig, settings, 0);
  MeasuredSession session(recording, rig, memory);
  std::printf("{\n");
  session.go_the_way();
  session.print_the_way();
  std::printf("  \"ate_before_the_end_m\": %.4f,\n", error_of(session.map(), recording));
  session.finish();
  std::printf("  \"keyframes\": %zu,\n", session.map().keyframes().size());
  std::printf("  \"ate_m\": %.4f,\n", error_of(session.map(), recording));
  std::printf("  \"peak_kb_per_keyframe\": %.0f,\n", session.kb_per_keyframe("VmHWM"));
  std::printf("  \"fingerprint\": \"%016llx\"\n}\n",
              static_cast<unsigned long long>(fingerprint(session.map())));
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
    waymark::run(static_cast<std::size_t>(std::atoll(argv[1])), memory);
  } catch (const waymark::OutputError& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}

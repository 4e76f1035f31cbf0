// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "session.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <optional>
#include <utility>

#include "waymark/base/check.h"

namespace waymark {
namespace {

using Clock = std::chrono::steady_clock;

double cpu_seconds(const rusage& usage) {
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

rusage resources() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return usage;
}

FrameRecord record_of_fault(const InputFrame& frame) {
  FrameRecord record;
  record.index = frame.index;
  record.timestamp_ns = frame.timestamp_ns;
  record.state = FrameState::kUnreadable;
  record.reason = frame.fault == FrameFault::kWrongSize ? FrameReason::kWrongSize
                                                        : FrameReason::kUnreadableImage;
  return record;
}

FrameRecord record_of_result(const InputFrame& frame, const TrackingResult& result) {
  FrameRecord record;
  record.index = frame.index;
  record.timestamp_ns = frame.timestamp_ns;
  record.state = result.state;
  record.reason = result.reason;
  record.num_matches = result.num_matches;
  record.num_inliers = result.num_inliers;
  record.is_keyframe = result.is_keyframe;
  if (result.submap.is_valid()) record.submap = result.submap.value;
  record.stage_ms.assign(result.stages.ms.begin(), result.stages.ms.end());
  return record;
}

FrameInput borrow(const InputFrame& frame) {
  FrameInput input;
  input.timestamp_ns = frame.timestamp_ns;
  input.image0 = frame.images.at(0).view();
  if (frame.images.size() > 1) input.image1 = frame.images[1].view();
  if (frame.depth) input.depth = frame.depth->view();
  if (frame.mask) input.mask = frame.mask->view();
  return input;
}

/// The rows so far, and which of them the system has seen: fed[i] is the row of its frame i.
struct FedFrames {
  FrameTable table;
  std::vector<std::size_t> fed;
  std::vector<double> tracking_ms;
};

FedFrames feed_all(Input& input,
                   System& system,
                   const std::function<bool()>& should_stop,
                   const FrameObserver& observer) {
  FedFrames frames;
  frames.table.stages.assign(kStageNames.begin(), kStageNames.end());
  while (!should_stop()) {
    const std::optional<InputFrame> frame = input.next();
    if (!frame) break;
    if (frame->fault != FrameFault::kNone) {
      frames.table.frames.push_back(record_of_fault(*frame));
    } else {
      const TrackingResult result = system.feed(borrow(*frame));
      frames.fed.push_back(frames.table.frames.size());
      frames.tracking_ms.push_back(result.stages.tracking_ms());
      frames.table.frames.push_back(record_of_result(*frame, result));
    }
    observer(frames.table.frames.back());
  }
  return frames;
}

/// What became of the frames after the fact: filled in, moved to another sub-map.
void update_states(const System& system, FedFrames& frames) {
  const std::vector<FrameState> states = system.frame_states();
  WAYMARK_CHECK(states.size() == frames.fed.size());
  for (std::size_t i = 0; i < states.size(); ++i) {
    FrameRecord& record = frames.table.frames[frames.fed[i]];
    record.state = states[i];
    if (states[i] == FrameState::kFilled) record.reason = FrameReason::kNone;
  }
  for (const TrajectoryFrame& frame : system.trajectory()) {
    frames.table.frames[frames.fed.at(frame.frame.value)].submap = frame.submap.value;
  }
}

/// The frames of each sub-map, most frames first, the older sub-map where they tie.
std::vector<std::pair<SubmapId, std::vector<StampedPose>>> split_by_submap(const System& system) {
  std::map<SubmapId, std::vector<StampedPose>> by_submap;
  for (const TrajectoryFrame& frame : system.trajectory()) {
    by_submap[frame.submap].push_back({frame.timestamp_ns, frame.world_from_rig});
  }
  std::vector<std::pair<SubmapId, std::vector<StampedPose>>> parts(by_submap.begin(),
                                                                   by_submap.end());
  std::stable_sort(parts.begin(), parts.end(), [](const auto& a, const auto& b) {
    return a.second.size() > b.second.size();
  });
  return parts;
}

std::vector<StampedPose> keyframe_poses(const Map& map, SubmapId submap) {
  std::vector<StampedPose> poses;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    if (keyframe.submap != submap) return;
    poses.push_back({keyframe.timestamp_ns, keyframe.rig_from_world.inverse()});
  });
  std::sort(poses.begin(), poses.end(), [](const StampedPose& a, const StampedPose& b) {
    return a.timestamp_ns < b.timestamp_ns;
  });
  return poses;
}

RunSummary summarize(const System& system, const FedFrames& frames) {
  const SystemStatistics statistics = system.statistics();
  RunSummary summary;
  summary.counts = count_frames(frames.table.frames);
  summary.keyframes = static_cast<std::size_t>(statistics.num_keyframes);
  summary.landmarks = static_cast<std::size_t>(statistics.num_landmarks);
  summary.submaps = static_cast<std::size_t>(statistics.num_submaps);
  summary.loops = static_cast<std::size_t>(statistics.num_loops);
  summary.relocalizations = static_cast<std::size_t>(statistics.num_relocalizations);
  summary.tracking_ms = summarize_times(frames.tracking_ms);
  summary.mapping_ms = summarize_times(statistics.mapping_ms);
  summary.stages_ms = summarize_stages(frames.table);
  return summary;
}

}  // namespace

SessionResults run_session(Input& input,
                           System& system,
                           const std::function<bool()>& should_stop,
                           const FrameObserver& observer) {
  const Clock::time_point start = Clock::now();
  const double cpu_start_s = cpu_seconds(resources());
  FedFrames frames = feed_all(input, system, should_stop, observer);
  system.finish();
  update_states(system, frames);

  SessionResults results;
  results.summary = summarize(system, frames);
  for (auto& [submap, poses] : split_by_submap(system)) {
    if (results.trajectories.empty()) results.keyframes = keyframe_poses(*system.map(), submap);
    results.trajectories.push_back(std::move(poses));
  }
  if (!results.trajectories.empty()) {
    results.summary.num_trajectory_lines = results.trajectories.front().size();
  }
  results.table = std::move(frames.table);
  const rusage usage = resources();
  results.summary.wall_s = std::chrono::duration<double>(Clock::now() - start).count();
  results.summary.cpu_s = cpu_seconds(usage) - cpu_start_s;
  results.summary.peak_rss_mb = static_cast<double>(usage.ru_maxrss) / 1024.0;  // From kB.
  return results;
}

void write_results(const std::filesystem::path& folder, const SessionResults& results) {
  write_trajectories(folder, results.trajectories);
  write_trajectory(folder / "keyframes.txt", results.keyframes, TrajectoryFormat::kTum);
  write_frames_csv(folder, results.table);
  write_summary_json(folder, results.summary);
}

std::string_view to_string(Timing timing) {
  switch (timing) {
    case Timing::kInline:
      return "inline";
    case Timing::kLockstep:
      return "lockstep";
    case Timing::kRealtime:
      return "realtime";
  }
  return "unknown";
}

}  // namespace waymark

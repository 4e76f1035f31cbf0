// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/session.h"

#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/exchange/export_scene.h"

namespace waymark {
namespace {

/// What became of the frames after the fact: filled in, moved to another sub-map.
void update_states(const System& system, FedFrames& frames) {
  const std::vector<FrameState> states = system.frame_states();
  if (states.empty()) forget_session(frames);  // There was a reset since the last frame.
  WAYMARK_CHECK(states.size() == frames.fed.size());
  for (std::size_t i = 0; i < states.size(); ++i) {
    FrameRecord& record = frames.table.frames[frames.fed[i]];
    record.state = states[i];
    if (states[i] == FrameState::kFilled) record.reason = FrameReason::kNone;
  }
  for (const TrajectoryFrame& frame : system.trajectory()) {
    frames.table.frames[frames.fed.at(frame.frame.value)].submap = frame.submap;
  }
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

std::vector<std::pair<SubmapId, StampedPose>> list_poses(const System& system) {
  std::vector<std::pair<SubmapId, StampedPose>> poses;
  for (const TrajectoryFrame& frame : system.trajectory()) {
    poses.push_back({frame.submap, {frame.timestamp_ns, frame.world_from_rig}});
  }
  return poses;
}

}  // namespace

SessionResults run_session(Input& input, System& system, const SessionHooks& hooks) {
  const UsageMeter usage;
  const auto feed = [&](const FrameImages& frame) {
    TrackingResult result = system.feed(frame);
    if (hooks.on_result) hooks.on_result(frame, result);
    return result;
  };
  FedFrames frames = feed_all(input, feed, hooks.should_stop, hooks.observer);
  if (hooks.on_input_end) hooks.on_input_end();
  system.finish();
  update_states(system, frames);

  SessionResults results;
  results.summary = summarize(system, frames);
  add_trajectories(*system.map(), list_poses(system), results);
  results.table = std::move(frames.table);
  usage.write_to(results.summary);
  return results;
}

void add_trajectories(const Map& map,
                      const std::vector<std::pair<SubmapId, StampedPose>>& poses,
                      SessionResults& results) {
  for (auto& [submap, trajectory] : split_by_submap(poses)) {
    if (results.trajectories.empty()) results.keyframes = keyframe_trajectory(map, submap);
    results.trajectories.push_back(std::move(trajectory));
  }
  if (!results.trajectories.empty()) {
    results.summary.num_trajectory_lines = results.trajectories.front().size();
  }
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

SessionResults localize_input(Input& input,
                              Localizer& localizer,
                              ImageOrder order,
                              const std::function<bool()>& should_stop,
                              const FrameObserver& observer) {
  const UsageMeter usage;
  std::vector<std::pair<SubmapId, StampedPose>> poses;
  const auto feed = [&](const FrameImages& frame) {
    const TrackingResult result =
        order == ImageOrder::kStream ? localizer.track(frame) : localizer.locate(frame);
    if (result.world_from_rig) {
      poses.push_back({result.submap, {frame.timestamp_ns, *result.world_from_rig}});
    }
    return result;
  };
  FedFrames frames = feed_all(input, feed, should_stop, observer);

  SessionResults results;
  const Map& map = localizer.map();
  RunSummary& summary = results.summary;
  summary.counts = count_frames(frames.table.frames);
  summary.localized = poses.size();
  summary.keyframes = map.keyframes().size();
  summary.landmarks = map.landmarks().size();
  for (const Submap& submap : map.submaps()) summary.submaps += !submap.joined_into.is_valid();
  summary.tracking_ms = summarize_times(frames.tracking_ms);
  summary.stages_ms = summarize_stages(frames.table);
  add_trajectories(map, poses, results);
  results.table = std::move(frames.table);
  usage.write_to(summary);
  return results;
}

}  // namespace waymark

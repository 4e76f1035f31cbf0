// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/session.h"

#include <malloc.h>
#include <sys/mman.h>

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/exchange/export_scene.h"
#include "waymark/input/decode.h"
#include "waymark/session/imu_feed.h"
#include "waymark/session/quality.h"

namespace waymark {
namespace {

/// Where memory runs out, what is left to save with: addresses, behind which there is no memory.
/// An allocator that finds no more room may take a good part of them for a heap of its own.
class MemoryReserve {
 public:
  MemoryReserve() : start_(mmap(nullptr, kBytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0)) {}
  ~MemoryReserve() { release(); }
  MemoryReserve(const MemoryReserve&) = delete;
  MemoryReserve& operator=(const MemoryReserve&) = delete;

  void release() {
    if (start_ != MAP_FAILED) munmap(std::exchange(start_, MAP_FAILED), kBytes);
  }

 private:
  static constexpr std::size_t kBytes = std::size_t{64} << 20;
  void* start_;  ///< MAP_FAILED: there is none.
};

/// What became of the frames after the fact: some are filled in.
void update_states(const System& system, FedFrames& frames) {
  const std::vector<FrameState> states = system.frame_states();
  if (states.empty()) forget_session(frames);  // There was a reset since the last frame.
  // What fails while it is fed may be known to the system, but has no row.
  WAYMARK_CHECK(states.size() == frames.fed.size() || frames.failure);
  for (std::size_t i = 0; i < std::min(states.size(), frames.fed.size()); ++i) {
    FrameRecord& record = frames.table.frames[frames.fed[i]];
    record.state = states[i];
    if (states[i] == FrameState::kFilled) record.reason = FrameReason::kNone;
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
  summary.tracking_ms = summarize_times({frames.tracking_ms.begin(), frames.tracking_ms.end()});
  summary.mapping_ms = summarize_times(statistics.mapping_ms);
  summary.stages_ms = summarize_stages(frames.table);
  return summary;
}

std::optional<MarkerSummary> summarize(const MarkerReport& report) {
  if (report.family.empty()) return std::nullopt;
  MarkerSummary summary;
  summary.family = report.family;
  if (report.frame) {
    summary.frame = to_string(report.frame->basis);
    summary.scale_sigma = report.frame->scale_sigma;
    summary.survey_rms_m = report.frame->rms_m;
  }
  for (const SurveyedMarker& marker : report.markers) {
    summary.markers.push_back({marker.id,
                               to_string(marker.verdict),
                               marker.num_views,
                               marker.rms_px,
                               describe_fault(marker)});
  }
  return summary;
}

/// Finishes the system; what fails then ends the session as what fails before.
void finish(System& system, const SessionHooks& hooks, FedFrames& frames) {
  try {
    if (hooks.on_input_end) hooks.on_input_end();
    system.finish();
  } catch (...) {
    if (!frames.failure) frames.failure = std::current_exception();
  }
}

/// The poses of the frames that have a row, which gets the sub-map that they are in by now.
std::vector<std::pair<SubmapId, StampedPose>> list_poses(const System& system, FedFrames& frames) {
  std::vector<std::pair<SubmapId, StampedPose>> poses;
  poses.reserve(frames.fed.size());
  for (const TrajectoryFrame& frame : system.trajectory()) {
    if (frame.frame.value >= frames.fed.size()) break;
    frames.table.frames[frames.fed[frame.frame.value]].submap = frame.submap;
    poses.push_back({frame.submap, {frame.timestamp_ns, frame.world_from_rig}});
  }
  return poses;
}

/// Where places were seen again. Frames of the map count on from those of an earlier session.
std::vector<LoopFrames> list_loops(const System& system, const FedFrames& frames) {
  std::vector<LoopFrames> loops;
  if (frames.fed.empty()) return loops;
  const Map& map = *system.map();
  const std::size_t end = std::size_t{system.result().frame_in_map.value} + 1;
  const auto index_of = [&](KeyframeId id) -> std::optional<std::uint32_t> {
    const std::size_t frame = map.keyframes().at(id).frame.value;
    const std::size_t before = end - std::min(end, frames.fed.size());
    if (frame < before || frame >= end) return std::nullopt;
    return frames.table.frames[frames.fed[frame - before]].index;
  };
  for (const LoopEdge& edge : map.measured_loop_edges()) {
    loops.push_back({index_of(edge.from), index_of(edge.to)});
  }
  return loops;
}

/// Takes no more memory than what comes out.
std::vector<Eigen::Vector3f> choose_points(const Map& map, SubmapId submap) {
  std::size_t num_all = 0;
  map.landmarks().for_each(
      [&](LandmarkId, const Landmark& landmark) { num_all += landmark.submap == submap; });
  const std::size_t step =
      std::max<std::size_t>((num_all + kMaxShownPoints - 1) / kMaxShownPoints, 1);
  std::vector<Eigen::Vector3f> points;
  points.reserve(num_all / step + 1);
  std::size_t at = 0;
  map.landmarks().for_each([&](LandmarkId, const Landmark& landmark) {
    if (landmark.submap != submap || at++ % step != 0) return;
    points.push_back(landmark.position_in_world.cast<float>());
  });
  return points;
}

double ego_share(const Image& mask) {
  if (mask.values.empty()) return 0.0;
  return static_cast<double>(std::ranges::count(mask.values, 0)) /
         static_cast<double>(mask.values.size());
}

/// Or removes that of an earlier run where there is nothing to write.
void write_or_remove(const std::filesystem::path& path, std::string_view content) {
  std::error_code error;
  if (content.empty()) {
    std::filesystem::remove(path, error);
  } else {
    write_file_atomically(path, content);
  }
}

/// The first one at the rate of an IMU, where that is asked for.
std::vector<std::vector<StampedPose>> written_trajectories(const SessionResults& results) {
  std::vector<std::vector<StampedPose>> written = results.trajectories;
  if (!results.at_imu_rate.empty()) written.front() = results.at_imu_rate;
  return written;
}

/// Throws InputError for files that results would take the place of.
void expect_no_results(const std::filesystem::path& folder) {
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (!is_result_name(name) || !entry.is_regular_file()) continue;
    throw InputError(
        folder.string(),
        "holds " + name + ", which no run left there, expected a new folder or results of a run");
  }
}

/// Fills in the trajectories of all sub-maps, and what follows from them.
void add_trajectories(const Map& map,
                      const std::vector<std::pair<SubmapId, StampedPose>>& poses,
                      SessionResults& results) {
  for (auto& [submap, trajectory] : split_by_submap(poses)) {
    if (results.trajectories.empty()) {
      results.keyframes = keyframe_trajectory(map, submap);
      results.points = choose_points(map, submap);
    }
    results.trajectories.push_back(std::move(trajectory));
  }
  if (!results.trajectories.empty()) {
    results.summary.num_trajectory_lines = results.trajectories.front().size();
  }
}

/// Where the first trajectory is the one that it is of: that with most frames and with most of the
/// map are hardly ever two.
void add_inertial_path(const System& system, bool wants_imu_rate, SessionResults& results) {
  const std::vector<NavigationState>& path = system.inertial_path();
  if (path.empty() || results.trajectories.empty()) return;
  const auto is_first = [&](const StampedPose& pose) {
    return pose.timestamp_ns == path.front().timestamp_ns;
  };
  if (std::ranges::none_of(results.trajectories.front(), is_first)) return;
  results.inertial = path;
  if (!wants_imu_rate) return;
  for (const NavigationState& state : system.inertial_path_at_imu_rate()) {
    results.at_imu_rate.push_back({state.timestamp_ns, state.world_from_rig});
  }
}

}  // namespace

SessionResults run_session(Input& input, System& system, const SessionHooks& hooks) {
  const UsageMeter usage;
  MemoryReserve reserve;
  ImuFeed imu(input.info().imu, system);
  const auto feed = [&](const FrameImages& frame) {
    imu.feed_until(frame.timestamp_ns);
    TrackingResult result = system.feed(frame);
    if (hooks.on_result) hooks.on_result(frame, result);
    if (hooks.watch) hooks.watch->add(frame, result, system);
    return result;
  };
  const auto observe = [&](const FrameRecord& record, const std::string& warning) {
    if (hooks.watch) hooks.watch->add_time(record.index, record.timestamp_ns);
    if (hooks.observer) hooks.observer(record, warning);
  };
  EarlyStages stages;
  if (!hooks.is_paced && !input.info().is_live) stages.num_prepared = system.max_prepared();
  stages.on_decoded = hooks.on_decoded;
  stages.prepare = [&](const FrameImages& frame, std::shared_ptr<const void> owner) {
    system.prepare(frame, std::move(owner));
  };
  FedFrames frames = feed_all(input, feed, hooks.should_stop, observe, stages);
  finish(system, hooks, frames);
  reserve.release();
  if (hooks.watch) hooks.watch->finish();
  malloc_trim(0);  // What frames saw is settled and gone: lists of results take its place.
  update_states(system, frames);

  SessionResults results;
  results.summary = summarize(system, frames);
  add_trajectories(*system.map(), list_poses(system, frames), results);
  results.summary.loop_frames = list_loops(system, frames);
  results.summary.imu = imu.report(frames);
  add_inertial_path(system, hooks.wants_imu_rate, results);
  for (const TransferredScale& kept : system.kept_scales()) {
    results.summary.scales.push_back({kept.submap.value, kept.before.value});
  }
  results.table = std::move(frames.table);
  if (results.summary.counts.tracked > 0) {
    results.summary.quality = assess(*system.map(), results.table.frames, results.trajectories);
  }
  results.summary.markers = summarize(system.markers());
  results.ego_mask = system.ego_mask();
  results.summary.moves_along = ego_share(results.ego_mask);
  if (hooks.watch) results.summary.mistakes = hooks.watch->mistakes();
  results.failure = frames.failure;
  usage.write_to(results.summary);
  return results;
}

bool prepare_results(const std::filesystem::path& folder) {
  make_output_folder(folder);
  const bool is_earlier_run = holds_results(folder);
  if (!is_earlier_run) expect_no_results(folder);
  for (const char* name :
       {"trajectory.txt", "keyframes.txt", "points.ply", "summary.json", "frames.csv"}) {
    AtomicFile{folder / name};
    remove_abandoned_parts(folder / name);
  }
  return is_earlier_run;
}

void write_results(const std::filesystem::path& folder, const SessionResults& results) {
  const FrameTable& table = results.table;
  save_each(
      {[&] { write_trajectories(folder, written_trajectories(results), table.has_times); },
       [&] {
         write_or_remove(folder / "inertial.csv",
                         results.inertial.empty() ? "" : format_inertial_csv(results.inertial));
       },
       [&] {
         write_or_remove(folder / "poses.csv",
                         table.names.empty() ? "" : format_poses_csv(table, results.trajectories));
       },
       [&] {
         write_trajectory(folder / "keyframes.txt", results.keyframes, TrajectoryFormat::kTum);
       },
       [&] { write_file_atomically(folder / "points.ply", format_points_ply(results.points)); },
       [&] { write_summary_json(folder, results.summary); },
       [&] {
         write_or_remove(folder / "view_mask.png",
                         results.ego_mask.values.empty() ? "" : encode_png(results.ego_mask));
       },
       [&] { write_frames_csv(folder, table); }});
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

SessionResults locate_all(Input& input,
                          const LocateFrame& locate,
                          const Map& map,
                          const std::function<bool()>& should_stop,
                          const FrameObserver& observer) {
  const UsageMeter usage;
  MemoryReserve reserve;
  std::vector<std::pair<SubmapId, StampedPose>> poses;
  const auto feed = [&](const FrameImages& frame) {
    const TrackingResult result = locate(frame);
    if (result.world_from_rig) {
      poses.push_back({result.submap, {frame.timestamp_ns, *result.world_from_rig}});
    }
    return result;
  };
  FedFrames frames = feed_all(input, feed, should_stop, observer);
  reserve.release();

  SessionResults results;
  RunSummary& summary = results.summary;
  summary.counts = count_frames(frames.table.frames);
  summary.localized = poses.size();
  summary.tracking_ms = summarize_times({frames.tracking_ms.begin(), frames.tracking_ms.end()});
  summary.stages_ms = summarize_stages(frames.table);
  add_trajectories(map, poses, results);
  results.table = std::move(frames.table);
  results.failure = frames.failure;
  usage.write_to(summary);
  return results;
}

SessionResults localize_input(Input& input,
                              Localizer& localizer,
                              ImageOrder order,
                              const std::function<bool()>& should_stop,
                              const FrameObserver& observer,
                              MapDepthCheck* check) {
  const auto locate = [&](const FrameImages& frame) {
    TrackingResult result =
        order == ImageOrder::kStream ? localizer.track(frame) : localizer.locate(frame);
    if (check) check->add(frame, result);
    return result;
  };
  const Map& map = localizer.map();
  SessionResults results = locate_all(input, locate, map, should_stop, observer);
  RunSummary& summary = results.summary;
  summary.keyframes = map.keyframes().size();
  summary.landmarks = map.landmarks().size();
  for (const Submap& submap : map.submaps()) summary.submaps += !submap.joined_into.is_valid();
  return results;
}

}  // namespace waymark

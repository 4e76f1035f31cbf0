// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <exception>
#include <filesystem>
#include <functional>
#include <string_view>
#include <utility>
#include <vector>

#include "waymark/input/input.h"
#include "waymark/map/map.h"
#include "waymark/results/results.h"
#include "waymark/results/trajectory.h"
#include "waymark/session/calibration_monitor.h"
#include "waymark/session/frame_feed.h"
#include "waymark/system/localizer.h"
#include "waymark/system/system.h"

namespace waymark {

/// Points are for a look at the map: so many are plenty. Of more, every second, third, ... is
/// taken.
inline constexpr std::size_t kMaxShownPoints = 10'000;

/// Everything a session leaves behind.
struct SessionResults {
  FrameTable table;  ///< A row per input frame, in order.
  /// One trajectory per sub-map, that with most frames first; world_from_camera0.
  std::vector<std::vector<StampedPose>> trajectories;
  std::vector<StampedPose> keyframes;  ///< All of the sub-map of the first trajectory.
  /// Some landmarks of the same, in its frame: see kMaxShownPoints.
  std::vector<Eigen::Vector3f> points;
  /// Frames of the first trajectory as an IMU and vision tell them; empty without.
  std::vector<NavigationState> inertial;
  /// What trajectory.txt has for the first trajectory where it is asked for at the IMU's rate.
  std::vector<StampedPose> at_imu_rate;
  RunSummary summary;
  Image ego_mask;  ///< What was found to move along with camera 0, see System::ego_mask().
  /// What ended the session before its input did; the rest is what there was until then.
  std::exception_ptr failure;
};

/// Who takes part in a session while it runs; any may be empty or null.
struct SessionHooks {
  std::function<bool()> should_stop;            ///< Asked before each frame.
  std::function<void(InputFrame&)> on_decoded;  ///< See EarlyStages.
  FrameObserver observer;
  /// Hears of each frame that was fed.
  std::function<void(const FrameImages&, const TrackingResult&)> on_result;
  std::function<void()> on_input_end;
  CalibrationMonitor* watch = nullptr;  ///< Its mistakes become part of the summary.
  bool wants_imu_rate = false;          ///< Whether results have at_imu_rate.
  bool is_paced = false;  ///< Frames come at their own pace: none is read before its turn.
};

/// Feeds an input to a system until it ends or should_stop() says so, finishes the system and
/// collects the results. Frames with a fault are not fed, but have their row. setup, timing, seed
/// and version of the summary are left to the caller. What is thrown once a frame was fed ends the
/// session, whose results until then come with that failure.
SessionResults run_session(Input& input, System& system, const SessionHooks& hooks = {});

/// Makes the folder and tries its files, so that write_results() will not be the first to find out
/// that they cannot be written: OutputError. Whether results of an earlier run will be replaced;
/// InputError for files with their names that no run left there.
bool prepare_results(const std::filesystem::path& folder);

/// Writes trajectory.txt, trajectory_1.txt ..., keyframes.txt, points.ply, frames.csv, summary.json
/// and, where something moves along, view_mask.png, where images have names, poses.csv, each
/// whatever becomes of the others; throws OutputError.
void write_results(const std::filesystem::path& folder, const SessionResults& results);

/// "inline", "lockstep", "realtime".
std::string_view to_string(Timing timing);

/// Whether images follow each other or have nothing to do with each other.
enum class ImageOrder { kStream, kUnordered };

/// Finds all frames of an input in the map of a localizer until it ends or should_stop() says so.
/// The trajectories are in the map's frames, keyframes and counts those of the map. setup, timing,
/// seed and version of the summary are left to the caller. check: hears of all frames; null: none.
SessionResults localize_input(Input& input,
                              Localizer& localizer,
                              ImageOrder order,
                              const std::function<bool()>& should_stop,
                              const FrameObserver& observer,
                              MapDepthCheck* check = nullptr);

/// Finds a frame in whatever it is looked for.
using LocateFrame = std::function<TrackingResult(const FrameImages&)>;

/// The same of anything that finds frames. Keyframes and points are those of the map; how much is
/// in it is left to the caller, too.
SessionResults locate_all(Input& input,
                          const LocateFrame& locate,
                          const Map& map,
                          const std::function<bool()>& should_stop,
                          const FrameObserver& observer);

}  // namespace waymark

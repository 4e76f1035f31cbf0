// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The files that a run leaves.
//
//   FrameTable table;
//   table.frames.push_back(FrameRecord());
//   const FrameCounts counts = count_frames(table.frames);
//   write_frames_csv("out", table);
//   std::cout << counts.tracked << " of " << counts.frames << " frames tracked\n";

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "waymark/base/frame_state.h"
#include "waymark/camera/calibration.h"
#include "waymark/image/image_statistics.h"
#include "waymark/imu/inertial_path.h"
#include "waymark/imu/inertial_report.h"
#include "waymark/results/trajectory.h"

namespace waymark {

/// One row of frames.csv. Small: rows stay as long as a session.
struct FrameRecord : FrameStatus {
  std::uint32_t index = 0;                      ///< In the whole INPUT.
  std::int64_t timestamp_ns = 0;                ///< Of the input.
  static constexpr std::size_t kMaxStages = 8;  ///< For an array of fixed size.
  /// In the order of the table's stages, to 0.05 %.
  std::array<Eigen::half, kMaxStages> stage_ms{};
  std::uint8_t num_stages = 0;  ///< 0 for a frame that was not processed.
  bool is_keyframe = false;     ///< Whether it was sent to the map.
  bool has_warning = false;     ///< Something is wrong with a file of it.
  bool is_relocalized = false;  ///< Whether the camera was found again after a loss.
  /// Of camera 0; nothing for a frame that was not processed.
  std::optional<std::uint16_t> num_features;
  ImageStatistics picture;  ///< Of the image of camera 0.

  /// Takes the times of all stages over.
  void set_stages(std::span<const double> times_ms);
};

/// frames.csv: a row per input frame.
struct FrameTable {
  std::vector<std::string> stages;  ///< Columns "STAGE_ms".
  std::vector<FrameRecord> frames;  ///< In the order of the input.
  /// Of the image files of the frames, where images have nothing to do with each other; else empty.
  std::vector<std::string> names;
  bool has_times = true;  ///< Else the times of frames only tell them apart, and are not written.
};

/// Of times in milliseconds.
struct TimeStatistics {
  double mean = 0.0;    ///< Arithmetic mean.
  double median = 0.0;  ///< See summarize_times().
  double p95 = 0.0;     ///< See summarize_times().
  double max = 0.0;     ///< The largest.
};

/// Statistics of samples; all 0 without samples. The median of an even number is the mean of the
/// middle two, p95 the smallest sample that 95 % do not exceed.
TimeStatistics summarize_times(std::vector<double> samples_ms);

/// What follows from the rows of a FrameTable alone.
struct FrameCounts {
  std::size_t frames = 0;                     ///< All rows.
  std::size_t tracked = 0;                    ///< With a pose in any sub-map, filled ones included.
  std::size_t filled = 0;                     ///< Those that got their pose after the fact.
  std::size_t unreadable = 0;                 ///< Those whose images could not be used.
  std::size_t dropped = 0;                    ///< Those that came too late.
  std::optional<std::size_t> initialized_at;  ///< Index of the first frame tracked.
  std::size_t lost_count = 0;                 ///< Transitions to lost.
};

/// Counts the rows, which are in the order of the input.
FrameCounts count_frames(std::span<const FrameRecord> frames);

/// How well what a session made agrees with itself.
struct RunQuality {
  /// Root mean square over all observations of the map, in pixels of the level of the feature.
  double reprojection_px = 0.0;
  double reprojection_percent = 0.0;  ///< The same, of the longer side of the images.
  double matches_kept = 0.0;  ///< Share of the matches of tracked frames that agree on the pose.
  double length = 0.0;        ///< Of all trajectories together.
  bool is_metric = false;     ///< Whether the length is in metres, rather than in map units.
};

/// A calibration that was estimated from the images, since the input carries none.
struct EstimatedCalibrationSummary {
  std::string model;            ///< "perspective", "fisheye" or "equirectangular".
  double focal_px = 0.0;        ///< Horizontally; 0 for 360 degree images.
  double focal_sigma_px = 0.0;  ///< Its standard deviation.
  double fov_deg = 0.0;         ///< Horizontal field of view.
  bool is_sure = false;         ///< Whether the motion told it.
};

/// Something to try, from what was seen in a run that did not go well.
struct RunAdvice {
  std::string cause;   ///< A short name that stays the same, for programs.
  std::string seen;    ///< What it is concluded from, with figures.
  std::string remedy;  ///< What to try.
  std::string see;     ///< Page and section of the documentation.
};

/// A place seen again: frames by their index in the input; nothing for one of an earlier session.
struct LoopFrames {
  std::optional<std::uint32_t> from;  ///< That was in the map before.
  std::optional<std::uint32_t> to;    ///< That showed its place again.
};

/// A part of a map in mono whose unit of length is that of another part, to about a quarter.
struct ScaleSummary {
  std::uint32_t submap = 0;   ///< That has it, as frames.csv numbers it.
  std::uint32_t same_as = 0;  ///< Whose it is.
};

/// The markers of a run.
struct MarkerSummary {
  /// One marker of the map.
  struct Entry {
    int id = 0;                     ///< Its number.
    std::string verdict;            ///< "used", or why it was left out.
    std::size_t num_keyframes = 0;  ///< That see it.
    double rms_px = 0.0;            ///< Of its corners.
    std::string fault;              ///< In words; empty where it is used.
  };
  std::string family;          ///< As it was asked for.
  std::string frame = "none";  ///< "none", "scale", "marker 0" or "surveyed".
  double scale_sigma = 0.0;    ///< Of the scale, as a part of it; 0 where it is known otherwise.
  double survey_rms_m = 0.0;   ///< Of the corners of surveyed markers.
  std::vector<Entry> markers;  ///< By number.
};

/// summary.json.
struct RunSummary {
  FrameCounts counts;                    ///< Of the rows of frames.csv.
  std::size_t out_of_order = 0;          ///< Frames left out, see InputCounts.
  std::size_t without_partner = 0;       ///< Frames of camera 0 alone, see InputCounts.
  std::size_t missing_at_end = 0;        ///< Frames that a video lacks, see InputCounts.
  std::size_t num_trajectory_lines = 0;  ///< Of trajectory.txt; gives the coverage.
  std::size_t keyframes = 0;             ///< Of the map at the end.
  std::size_t landmarks = 0;             ///< Of the map at the end.
  std::size_t submaps = 0;               ///< Those that were not joined.
  std::size_t loops = 0;                 ///< Closed in the session.
  std::size_t relocalizations = 0;       ///< Of the session.
  double wall_s = 0.0;                   ///< From start to end.
  double cpu_s = 0.0;                    ///< Of all threads.
  double peak_rss_mb = 0.0;              ///< Largest memory in use, in units of 2^20 bytes.
  TimeStatistics tracking_ms;            ///< Per frame.
  TimeStatistics mapping_ms;             ///< Per keyframe.
  std::vector<std::pair<std::string, TimeStatistics>> stages_ms;  ///< By name of the stage.
  std::string setup;                                              ///< "mono", "stereo" or "rgbd".
  std::string timing;                    ///< "inline", "lockstep" or "realtime".
  std::uint64_t seed = 0;                ///< Of the settings.
  std::string version;                   ///< Of the program.
  std::optional<std::size_t> localized;  ///< Of localize only.
  std::optional<RunQuality> quality;     ///< Of run only.
  std::optional<double> moves_along;  ///< Of run only: part of the image, see System::ego_mask().
  /// What seems to be wrong with the calibration and the time stamps, in words; of localize only
  /// where depth contradicts the map.
  std::optional<std::vector<std::string>> mistakes = std::nullopt;
  std::optional<EstimatedCalibrationSummary> calibration = std::nullopt;  ///< Where none was given.
  std::vector<CalibrationEstimate> refined_calibration;  ///< Empty where it stayed as it was.
  std::vector<LoopFrames> loop_frames;                   ///< Where the map was closed or joined.
  std::vector<ScaleSummary> scales;  ///< Of run only; empty where no part has another's.
  std::vector<std::string> input;    ///< What was understood of it, in words.
  /// Settings that are not as by default, "KEY: VALUE" as in a file.
  std::vector<std::string> settings;
  std::vector<RunAdvice> advice;                        ///< Empty where all went well.
  std::optional<MarkerSummary> markers = std::nullopt;  ///< Where some were looked for.
  /// Where there was an IMU; frames are those of the table.
  std::optional<InertialReport> imu = std::nullopt;
};

/// Statistics per stage over all rows, in the order of the table.
std::vector<std::pair<std::string, TimeStatistics>> summarize_stages(const FrameTable& table);

/// The text of frames.csv: a line of names, a line per frame.
std::string format_frames_csv(const FrameTable& table);
/// The text of summary.json.
std::string format_summary_json(const RunSummary& summary);

/// Whether a file of this name in a folder is one of those that a run leaves there.
bool is_result_name(std::string_view name);
/// Whether a run left its results in a folder: its summary or its table is there.
bool holds_results(const std::filesystem::path& folder);

/// The text of poses.csv: a line of names, a line per frame that was found in one of the
/// trajectories. For tables with names.
std::string format_poses_csv(const FrameTable& table,
                             std::span<const std::vector<StampedPose>> trajectories);

/// The text of inertial.csv: what vision and an IMU tell together of each frame.
std::string format_inertial_csv(std::span<const NavigationState> states);

/// Writes frames.csv into the folder; throws OutputError.
void write_frames_csv(const std::filesystem::path& folder, const FrameTable& table);
/// Writes summary.json into the folder; throws OutputError.
void write_summary_json(const std::filesystem::path& folder, const RunSummary& summary);

/// The text of points.ply: points as the Stanford polygon format (Turk 1994) has them, in ASCII.
std::string format_points_ply(std::span<const Eigen::Vector3f> points);

/// Writes trajectory.txt (TUM) for the first trajectory, trajectory_1.txt ... for the others, and
/// removes those of an earlier run that are left over. Without times there is none. The caller
/// orders them by size.
void write_trajectories(const std::filesystem::path& folder,
                        std::span<const std::vector<StampedPose>> trajectories,
                        bool has_times = true);

}  // namespace waymark

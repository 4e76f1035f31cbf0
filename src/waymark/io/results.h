// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/frame_state.h"
#include "waymark/io/trajectory.h"

namespace waymark {

/// One row of frames.csv.
struct FrameRecord {
  std::size_t index = 0;  ///< In the whole INPUT.
  std::int64_t timestamp_ns = 0;
  FrameState state = FrameState::kLost;
  FrameReason reason = FrameReason::kNone;
  int num_matches = 0;
  int num_inliers = 0;
  int num_candidates = 0;  ///< Places compared while relocalising; for people, not in the file.
  bool is_keyframe = false;
  std::optional<std::uint32_t> submap;  ///< Empty field when the frame belongs to none.
  /// In the order of the table's stages; empty for a frame that was not processed.
  std::vector<double> stage_ms;
};

/// frames.csv: a row per input frame.
struct FrameTable {
  std::vector<std::string> stages;  ///< Columns "STAGE_ms".
  std::vector<FrameRecord> frames;
};

struct TimeStatistics {
  double mean = 0.0;
  double median = 0.0;
  double p95 = 0.0;
  double max = 0.0;
};

/// Statistics of samples; all 0 without samples. The median of an even number is the mean of the
/// middle two, p95 the smallest sample that 95 % do not exceed.
TimeStatistics summarize_times(std::vector<double> samples_ms);

/// What follows from the rows of a FrameTable alone.
struct FrameCounts {
  std::size_t frames = 0;
  std::size_t tracked = 0;  ///< With a pose in any sub-map, filled ones included.
  std::size_t filled = 0;
  std::size_t unreadable = 0;
  std::size_t dropped = 0;
  std::optional<std::size_t> initialized_at;  ///< Index of the first frame tracked.
  std::size_t lost_count = 0;                 ///< Transitions to lost.
};

FrameCounts count_frames(std::span<const FrameRecord> frames);

/// summary.json.
struct RunSummary {
  FrameCounts counts;
  std::size_t num_trajectory_lines = 0;  ///< Of trajectory.txt; gives the coverage.
  std::size_t keyframes = 0;
  std::size_t landmarks = 0;
  std::size_t submaps = 0;
  std::size_t loops = 0;
  std::size_t relocalizations = 0;
  double wall_s = 0.0;
  double cpu_s = 0.0;
  double peak_rss_mb = 0.0;
  TimeStatistics tracking_ms;  ///< Per frame.
  TimeStatistics mapping_ms;   ///< Per keyframe.
  std::vector<std::pair<std::string, TimeStatistics>> stages_ms;
  std::string setup;
  std::string timing;
  std::uint64_t seed = 0;
  std::string version;
  std::optional<std::size_t> localized;  ///< Of localize only.
};

/// Statistics per stage over all rows, in the order of the table.
std::vector<std::pair<std::string, TimeStatistics>> summarize_stages(const FrameTable& table);

std::string format_frames_csv(const FrameTable& table);
std::string format_summary_json(const RunSummary& summary);

/// Write frames.csv and summary.json into the folder; throw OutputError.
void write_frames_csv(const std::filesystem::path& folder, const FrameTable& table);
void write_summary_json(const std::filesystem::path& folder, const RunSummary& summary);

/// Writes trajectory.txt (TUM) for the first trajectory, trajectory_1.txt ... for the others, and
/// removes those of an earlier run that are left over. The caller orders them by size.
void write_trajectories(const std::filesystem::path& folder,
                        std::span<const std::vector<StampedPose>> trajectories);

}  // namespace waymark

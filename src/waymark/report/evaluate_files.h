// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "waymark/evaluate/evaluation.h"
#include "waymark/results/results.h"

namespace waymark {

/// From here on time offsets do not fit into 64-bit nanoseconds.
inline constexpr double kMaxOffsetS = 9.2e9;

/// Two files to compare.
struct EvaluationRequest {
  std::filesystem::path estimate;
  std::filesystem::path groundtruth;
  /// Nothing: as the run that left the estimate beside its summary.json, else kSe3.
  std::optional<TrajectoryAlignment> alignment;
  std::int64_t time_offset_ns = 0;  ///< Is added to the times of the estimate,
  bool finds_time_offset = false;   ///< or is found: see find_time_offset().
  std::filesystem::path plot;       ///< SVG file to write; empty: none.
};

/// How they compare, and what was understood or seems to be wrong, in words.
struct FileEvaluation {
  Evaluation evaluation;
  std::vector<std::string> notes;
};

/// Reads both, compares them and writes the plot. Tells of clocks that differ, and of a scale that
/// is free. Throws InputError, OutputError.
FileEvaluation evaluate_files(const EvaluationRequest& request);
/// The same of poses in memory, in order of time, instead of the file of the estimate.
FileEvaluation evaluate_poses(std::span<const StampedPose> estimate,
                              const EvaluationRequest& request);

/// The alignment for what a run left: with a scale where that of the run is free.
TrajectoryAlignment alignment_for(const RunSummary& summary);

}  // namespace waymark

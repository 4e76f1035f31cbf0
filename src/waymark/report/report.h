// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "waymark/evaluate/evaluation.h"
#include "waymark/report/run_folder.h"

namespace waymark {

/// The true path of camera 0.
struct TruePath {
  std::string name;  ///< Of the file, for people.
  std::vector<StampedPose> poses;
  /// How a run is laid over it; nothing: with a scale where that of the run is free.
  std::optional<TrajectoryAlignment> alignment;
};

/// A page on one run, which needs nothing but itself: how well it went and why, what to try, path,
/// timeline, error, coverage, calibration, time, settings. truth: null for none. Throws InputError
/// where the run cannot be compared with it.
std::string format_report(const RunFolder& run, const TruePath* truth);

/// Reads what a run left in a folder and writes report.html beside it. Throws InputError,
/// OutputError.
void write_report(const std::filesystem::path& folder);

/// What a page is made of.
struct PageRequest {
  std::vector<std::filesystem::path> folders;  ///< That run or localize wrote; several to compare.
  std::filesystem::path groundtruth;           ///< Poses to compare with; empty: none.
  std::optional<TrajectoryAlignment> alignment;  ///< As in TruePath.
  /// The file to write; empty: report.html in the folder, of several comparison.html here.
  std::filesystem::path out;
};

/// Writes the page of a run, or of several to compare; the name of the file. Throws InputError,
/// OutputError.
std::filesystem::path write_page(const PageRequest& request);

/// A page that compares runs, two at least: their figures side by side, their paths over each
/// other. Where there is no ground truth, they are laid over the first, by equal times.
std::string format_run_comparison(std::span<const RunFolder> runs, const TruePath* truth);

/// A run against the truth; InputError where they do not go together.
Evaluation evaluate_run(const RunFolder& run, const TruePath& truth);

/// "m", or "map units" where the scale is free.
std::string length_unit(const RunFolder& run);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/results/results.h"
#include "waymark/results/trajectory.h"

namespace waymark {

/// What a run left in its folder, see docs/results.md. Files of versions before a figure was
/// recorded lack it, and so does this.
struct RunFolder {
  std::string name;    ///< Of the folder, for people.
  RunSummary summary;  ///< Its counts are those of the table.
  FrameTable table;
  /// One per part of the map, that with most frames first, each by time and in a frame of its own.
  std::vector<std::vector<StampedPose>> trajectories;
  std::vector<Eigen::Vector3f> points;  ///< Of the map of the first; may be missing.
  /// Of its frames, without poses and covariances; empty without an IMU that told metres.
  std::vector<NavigationState> inertial;
};

/// Reads the files of a folder. Whatever is wrong with one of them, be it damaged or made to do
/// harm, is an InputError that names the file and what was expected.
RunFolder read_run_folder(const std::filesystem::path& folder);

/// Parse the text of one file each; name is what errors call it.
FrameTable parse_frames_csv(std::string_view text, const std::string& name);
/// The same of summary.json; what it does not have stays as by default.
RunSummary parse_summary_json(std::string_view text, const std::string& name);
/// The same of points.ply, as format_points_ply() writes it.
std::vector<Eigen::Vector3f> parse_points_ply(std::string_view text, const std::string& name);

/// The same of inertial.csv.
std::vector<NavigationState> parse_inertial_csv(std::string_view text, const std::string& name);

}  // namespace waymark

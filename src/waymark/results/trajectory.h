// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Trajectories in files of TUM, KITTI and EuRoC.
//
//   std::vector<StampedPose> poses;
//   for (const TrajectoryFrame& frame : system.trajectory()) {
//     poses.push_back({frame.timestamp_ns, frame.world_from_rig});
//   }
//   write_trajectory("trajectory.txt", poses, TrajectoryFormat::kTum);

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/geometry/rigid3.h"

namespace waymark {

/// Pose of camera 0 at a time; metres (map units for a map of free scale).
struct StampedPose {
  std::int64_t timestamp_ns = 0;  ///< Of the image.
  Rigid3 world_from_camera;       ///< x right, y down, z forward.
};

/// kTum:   "t tx ty tz qx qy qz qw", seconds (Sturm et al. 2012).
/// kKitti: the upper 3x4 of the matrix, row by row, without time (Geiger et al. 2012).
/// kEuroc: "t,px,py,pz,qw,qx,qy,qz[,...]", nanoseconds (Burri et al. 2016).
enum class TrajectoryFormat { kTum, kKitti, kEuroc };

/// "tum", "kitti", "euroc".
std::string_view to_string(TrajectoryFormat format);

/// The text of a trajectory file, a pose per line in the order given.
std::string format_trajectory(std::span<const StampedPose> poses, TrajectoryFormat format);

/// Writes the file atomically; throws OutputError.
void write_trajectory(const std::filesystem::path& path,
                      std::span<const StampedPose> poses,
                      TrajectoryFormat format);

/// Parse text in one format; name is what errors call it. Rows keep their order. Throw InputError
/// for malformed rows and for rotations that are none.
std::vector<StampedPose> parse_tum_trajectory(std::string_view text, const std::string& name);
/// The same for rows of EuRoC.
std::vector<StampedPose> parse_euroc_trajectory(std::string_view text, const std::string& name);
/// The same for rows of KITTI, which have no time.
std::vector<Rigid3> parse_kitti_poses(std::string_view text, const std::string& name);

/// Reads a trajectory in any of the formats (recognised by its first row), sorted by time, at least
/// one pose. KITTI poses take their times from times_path, or from times.txt beside them or in
/// ../sequences/NAME/. EuRoC ground truth is of the body: with sensor.yaml files beside it, its
/// poses are moved to camera 0 (T_BS), otherwise they stay as they are. Throws InputError.
std::vector<StampedPose> read_trajectory(
    const std::filesystem::path& path,
    const std::optional<std::filesystem::path>& times_path = std::nullopt);

/// An estimated trajectory and the true one.
struct TrajectoryPair {
  std::vector<StampedPose> estimate;     ///< What is judged.
  std::vector<StampedPose> groundtruth;  ///< What it is held against.
  /// Whether neither has times, and line i of the one goes with line i of the other: the times are
  /// then the numbers of the lines, in seconds.
  bool is_by_line = false;
};

/// Reads both as read_trajectory() does. Two files of KITTI poses of which one at least has no
/// times go together line by line; InputError where they have different numbers of lines.
TrajectoryPair read_trajectories(const std::filesystem::path& estimate,
                                 const std::filesystem::path& groundtruth);

}  // namespace waymark

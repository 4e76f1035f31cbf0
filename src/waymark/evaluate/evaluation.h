// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A trajectory against the truth.
//
//   const std::vector<StampedPose> estimate = read_trajectory("out/trajectory.txt");
//   const std::vector<StampedPose> truth = read_trajectory("groundtruth.txt");
//   EvaluationOptions options;
//   options.alignment = TrajectoryAlignment::kSim3;
//   std::cout << evaluate(estimate, truth, options).ate_m.rmse << " m\n";

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "waymark/geometry/sim3.h"
#include "waymark/results/trajectory.h"

namespace waymark {

/// How the estimate is moved onto the ground truth before comparing.
enum class TrajectoryAlignment { kNone, kSe3, kSim3 };

/// "none", "se3", "sim3".
std::string_view to_string(TrajectoryAlignment alignment);

/// How two trajectories are compared.
struct EvaluationOptions {
  /// kSim3 where the scale is free (one camera), kNone where both have the same frame.
  TrajectoryAlignment alignment = TrajectoryAlignment::kSe3;
  std::int64_t max_difference_ns = 20'000'000;  ///< Between a pose and its true one.
  /// Input frames of the run; with it the coverage counts poses, without it time.
  std::optional<std::size_t> num_frames;
  std::int64_t time_offset_ns = 0;  ///< Is added to the times of the estimate.
  bool is_by_line = false;          ///< See TrajectoryPair.
};

/// Of the distances between estimated and true positions.
struct ErrorStatistics {
  double rmse = 0.0;    ///< Root of the mean square.
  double mean = 0.0;    ///< Arithmetic mean.
  double median = 0.0;  ///< Of an even number the mean of the middle two.
  double max = 0.0;     ///< The largest.
};

/// Distance between an estimated position, aligned, and the true one.
struct PositionError {
  std::int64_t timestamp_ns = 0;  ///< Of the estimated pose.
  double error_m = 0.0;           ///< In units of the ground truth.
};

/// Mean relative error over path segments of one length.
struct SegmentError {
  double length_m = 0.0;               ///< Along the true path.
  double translation_percent = 0.0;    ///< Position error at the end, in percent of the length.
  double rotation_deg_per_100m = 0.0;  ///< Angle error at the end, per 100 m of length.
  std::size_t num_segments = 0;        ///< That the mean is over.
};

/// The measure of the KITTI odometry benchmark (Geiger et al. 2012).
struct SegmentErrors {
  SegmentError all;                     ///< Mean over all segments; its length is the mean length.
  std::vector<SegmentError> by_length;  ///< 100, 200, ... 800 m, those that occur.
};

/// What a comparison gives. Lengths are in the unit of the ground truth, which is taken for metres.
struct Evaluation {
  TrajectoryAlignment alignment = TrajectoryAlignment::kSe3;  ///< That of the options.
  std::int64_t time_offset_ns = 0;                            ///< The same.
  bool is_by_line = false;                                    ///< The same.
  /// The motion that was applied to the estimate; identity for kNone.
  Sim3 groundtruth_from_estimate;
  std::size_t num_estimate_poses = 0;  ///< Poses of the estimate, with and without a true one.
  std::size_t num_pairs = 0;           ///< Poses that were compared.
  /// Estimated poses per input frame when their number is known, else covered_part().
  double coverage = 0.0;
  double path_length_m = 0.0;             ///< Of the true path through the pairs.
  ErrorStatistics ate_m;                  ///< Absolute trajectory error (Sturm et al. 2012).
  std::optional<double> ate_percent;      ///< 100 rmse / path length, unless that is 0.
  double rpe_m = 0.0;                     ///< Root mean square of the relative error of
  double rpe_deg = 0.0;                   ///< consecutive pairs, after scaling.
  std::optional<SegmentErrors> segments;  ///< For paths beyond 100 m.
  std::vector<PositionError> errors;      ///< Per pair, at the times with their offset.
};

/// Compares two trajectories, each sorted by time. Alignment after Umeyama (1991); measures as
/// discussed by Zhang and Scaramuzza (2018). Throws InputError when fewer than 3 poses pair or the
/// positions leave the alignment undefined.
Evaluation evaluate(std::span<const StampedPose> estimate,
                    std::span<const StampedPose> groundtruth,
                    const EvaluationOptions& options);

/// Poses world_from_camera, paired one to one, both metric in the same unit. Every tenth pose
/// starts a segment of each length along the true path. Nothing when the path is shorter than 100
/// m.
std::optional<SegmentErrors> segment_errors(std::span<const Rigid3> estimate,
                                            std::span<const Rigid3> groundtruth);

/// A pose of the estimate in the frame and scale of the ground truth.
Rigid3 aligned_pose(const Sim3& groundtruth_from_estimate, const Rigid3& world_from_camera);

}  // namespace waymark

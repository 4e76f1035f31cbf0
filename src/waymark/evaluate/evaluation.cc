// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/evaluate/evaluation.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "waymark/base/check.h"
#include "waymark/evaluate/association.h"
#include "waymark/evaluate/time_offset.h"
#include "waymark/geometry/rigid3.h"

namespace waymark {
namespace {

constexpr std::size_t kMinPairs = 3;
constexpr double kDegPerRad = 57.29577951308232;
/// Of the segments of the KITTI odometry benchmark.
constexpr std::array<double, 8> kSegmentLengths = {100, 200, 300, 400, 500, 600, 700, 800};
constexpr std::size_t kSegmentStartStep = 10;

/// Poses of pair i at index i of both.
struct PairedPoses {
  std::vector<Rigid3> estimate;
  std::vector<Rigid3> groundtruth;
};

Eigen::Matrix3Xd positions(std::span<const Rigid3> poses) {
  Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(poses.size()));
  for (std::size_t i = 0; i < poses.size(); ++i)
    points.col(static_cast<Eigen::Index>(i)) = poses[i].translation;
  return points;
}

Sim3 align(const PairedPoses& pairs, TrajectoryAlignment alignment) {
  if (alignment == TrajectoryAlignment::kNone) return {};
  const bool with_scale = alignment == TrajectoryAlignment::kSim3;
  const Eigen::Matrix3Xd from = positions(pairs.estimate);
  const Eigen::Matrix3Xd to = positions(pairs.groundtruth);
  const double spread = (from.colwise() - from.rowwise().mean()).norm();
  if (with_scale && !(spread > 0.0)) {
    throw InputError("evaluation",
                     "all estimated positions are equal, expected a motion to find the scale from");
  }
  const Eigen::Matrix4d matrix = Eigen::umeyama(from, to, with_scale);
  const double scale = with_scale ? std::cbrt(matrix.topLeftCorner<3, 3>().determinant()) : 1.0;
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>() / scale;
  if (!matrix.allFinite() || !(scale > 0.0)) {
    throw InputError("evaluation", "the alignment is undefined, expected trajectories with motion");
  }
  return {Eigen::Quaterniond(rotation).normalized(), matrix.topRightCorner<3, 1>(), scale};
}

ErrorStatistics summarize(const std::vector<PositionError>& errors) {
  std::vector<double> sorted;
  ErrorStatistics statistics;
  double sum_of_squares = 0.0;
  for (const PositionError& error : errors) {
    sorted.push_back(error.error_m);
    statistics.mean += error.error_m;
    sum_of_squares += error.error_m * error.error_m;
  }
  std::sort(sorted.begin(), sorted.end());
  const std::size_t n = sorted.size();
  statistics.rmse = std::sqrt(sum_of_squares / static_cast<double>(n));
  statistics.mean /= static_cast<double>(n);
  statistics.median = 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]);
  statistics.max = sorted.back();
  return statistics;
}

/// From the first pose to each.
std::vector<double> path_lengths(std::span<const Rigid3> poses) {
  std::vector<double> lengths(poses.size(), 0.0);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    lengths[i] = lengths[i - 1] + (poses[i].translation - poses[i - 1].translation).norm();
  }
  return lengths;
}

void add(SegmentError& sum, const SegmentError& other) {
  sum.length_m += other.length_m;
  sum.translation_percent += other.translation_percent;
  sum.rotation_deg_per_100m += other.rotation_deg_per_100m;
  sum.num_segments += other.num_segments;
}

SegmentError mean_of(const SegmentError& sum) {
  const double n = static_cast<double>(sum.num_segments);
  return {sum.length_m / n,
          sum.translation_percent / n,
          sum.rotation_deg_per_100m / n,
          sum.num_segments};
}

/// Difference of the motions between consecutive pairs, each motion seen from its first camera.
void add_relative_errors(const PairedPoses& pairs, double scale, Evaluation& evaluation) {
  double sum_m2 = 0.0;
  double sum_deg2 = 0.0;
  for (std::size_t i = 1; i < pairs.estimate.size(); ++i) {
    const Rigid3 motion = pairs.estimate[i - 1].inverse() * pairs.estimate[i];
    const Rigid3 true_motion = pairs.groundtruth[i - 1].inverse() * pairs.groundtruth[i];
    const double angle = so3_log(motion.rotation.conjugate() * true_motion.rotation).norm();
    sum_m2 += (scale * motion.translation - true_motion.translation).squaredNorm();
    sum_deg2 += std::pow(kDegPerRad * angle, 2);
  }
  const double n = static_cast<double>(pairs.estimate.size() - 1);
  evaluation.rpe_m = std::sqrt(sum_m2 / n);
  evaluation.rpe_deg = std::sqrt(sum_deg2 / n);
}

}  // namespace

std::string_view to_string(TrajectoryAlignment alignment) {
  switch (alignment) {
    case TrajectoryAlignment::kNone:
      return "none";
    case TrajectoryAlignment::kSe3:
      return "se3";
    case TrajectoryAlignment::kSim3:
      return "sim3";
  }
  fail_check("known TrajectoryAlignment", __FILE__, __LINE__);
}

std::optional<SegmentErrors> segment_errors(std::span<const Rigid3> estimate,
                                            std::span<const Rigid3> groundtruth) {
  WAYMARK_CHECK(estimate.size() == groundtruth.size());
  const std::vector<double> lengths = path_lengths(groundtruth);
  SegmentErrors errors;
  for (double length : kSegmentLengths) {
    SegmentError sum;
    for (std::size_t first = 0; first < groundtruth.size(); first += kSegmentStartStep) {
      const auto end = std::upper_bound(lengths.begin(), lengths.end(), lengths[first] + length);
      if (end == lengths.end()) break;
      const std::size_t last = static_cast<std::size_t>(end - lengths.begin());
      const Rigid3 true_motion = groundtruth[first].inverse() * groundtruth[last];
      const Rigid3 motion = estimate[first].inverse() * estimate[last];
      const Rigid3 error = motion.inverse() * true_motion;
      add(sum,
          {length,
           100.0 * error.translation.norm() / length,
           100.0 * kDegPerRad * so3_log(error.rotation).norm() / length,
           1});
    }
    if (sum.num_segments == 0) continue;
    add(errors.all, sum);
    errors.by_length.push_back(mean_of(sum));
  }
  if (errors.by_length.empty()) return std::nullopt;
  errors.all = mean_of(errors.all);
  return errors;
}

Rigid3 aligned_pose(const Sim3& groundtruth_from_estimate, const Rigid3& world_from_camera) {
  return {(groundtruth_from_estimate.rotation * world_from_camera.rotation).normalized(),
          groundtruth_from_estimate * world_from_camera.translation};
}

Evaluation evaluate(std::span<const StampedPose> as_given,
                    std::span<const StampedPose> groundtruth,
                    const EvaluationOptions& options) {
  std::vector<StampedPose> estimate(as_given.begin(), as_given.end());
  for (StampedPose& pose : estimate) {
    pose.timestamp_ns = moved_time(pose.timestamp_ns, options.time_offset_ns);
  }
  const std::vector<TimeMatch> matches =
      match_by_time(estimate, groundtruth, options.max_difference_ns);
  if (matches.size() < kMinPairs) {
    throw InputError("evaluation",
                     fmt::format("{} poses have a true one within {:g} s, expected at least {}",
                                 matches.size(),
                                 1e-9 * static_cast<double>(options.max_difference_ns),
                                 kMinPairs));
  }
  PairedPoses pairs;
  for (const TimeMatch& match : matches) {
    pairs.estimate.push_back(estimate[match.estimate].world_from_camera);
    pairs.groundtruth.push_back(groundtruth[match.groundtruth].world_from_camera);
  }
  Evaluation evaluation;
  evaluation.alignment = options.alignment;
  evaluation.time_offset_ns = options.time_offset_ns;
  evaluation.is_by_line = options.is_by_line;
  evaluation.groundtruth_from_estimate = align(pairs, options.alignment);
  evaluation.num_estimate_poses = estimate.size();
  evaluation.num_pairs = matches.size();
  evaluation.coverage =
      options.num_frames && *options.num_frames > 0
          ? static_cast<double>(estimate.size()) / static_cast<double>(*options.num_frames)
          : covered_part(estimate, groundtruth);
  std::vector<Rigid3> aligned;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    aligned.push_back(aligned_pose(evaluation.groundtruth_from_estimate, pairs.estimate[i]));
    const double error_m = (aligned.back().translation - pairs.groundtruth[i].translation).norm();
    evaluation.errors.push_back({estimate[matches[i].estimate].timestamp_ns, error_m});
  }
  evaluation.path_length_m = path_lengths(pairs.groundtruth).back();
  evaluation.ate_m = summarize(evaluation.errors);
  if (evaluation.path_length_m > 0.0) {
    evaluation.ate_percent = 100.0 * evaluation.ate_m.rmse / evaluation.path_length_m;
  }
  add_relative_errors(pairs, evaluation.groundtruth_from_estimate.scale, evaluation);
  evaluation.segments = segment_errors(aligned, pairs.groundtruth);
  return evaluation;
}

}  // namespace waymark

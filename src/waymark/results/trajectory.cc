// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/results/trajectory.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <initializer_list>
#include <iterator>

#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/base/time_column.h"
#include "waymark/input/datasets.h"

namespace waymark {
namespace {

constexpr const char* kTumLayout = "8: t tx ty tz qx qy qz qw";
constexpr const char* kEurocLayout = "8 or more: t,px,py,pz,qw,qx,qy,qz";
constexpr const char* kKittiLayout = "12: a 3x4 matrix row by row";
constexpr const char* kEurocHeader =
    "#timestamp [ns],p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z []\n";
/// How far from a rotation a given one may be: files with few digits must pass, swapped columns
/// not.
constexpr double kRotationTolerance = 0.02;

Eigen::Vector3d read_position(const RowReader& rows) {
  return {rows.number(1), rows.number(2), rows.number(3)};
}

Eigen::Quaterniond checked_rotation(const RowReader& rows, const Eigen::Quaterniond& rotation) {
  const double norm = rotation.norm();
  if (!(std::abs(norm - 1.0) <= kRotationTolerance)) {
    throw InputError(rows.where(), fmt::format("quaternion of length {:.4g}, expected 1", norm));
  }
  return rotation.normalized();
}

Eigen::Quaterniond checked_rotation(const RowReader& rows, const Eigen::Matrix3d& matrix) {
  const Eigen::Matrix3d excess = matrix * matrix.transpose() - Eigen::Matrix3d::Identity();
  if (!(excess.cwiseAbs().maxCoeff() <= kRotationTolerance) || matrix.determinant() < 0.0) {
    throw InputError(rows.where(), "the matrix is no rotation, expected orthogonal unit rows");
  }
  // The nearest rotation, since files carry few digits.
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return Eigen::Quaterniond(Eigen::Matrix3d(svd.matrixU() * svd.matrixV().transpose()))
      .normalized();
}

void append_pose(std::string& text, const StampedPose& pose, TrajectoryFormat format) {
  const Eigen::Vector3d& t = pose.world_from_camera.translation;
  const Eigen::Quaterniond& q = pose.world_from_camera.rotation;
  const auto append = [&](char separator, std::initializer_list<double> numbers) {
    for (const double number : numbers) text += separator + format_decimals(number, 9);
  };
  switch (format) {
    case TrajectoryFormat::kTum:
      text += format_seconds(pose.timestamp_ns);
      append(' ', {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()});
      text += '\n';
      return;
    case TrajectoryFormat::kEuroc:
      text += std::to_string(pose.timestamp_ns);
      append(',', {t.x(), t.y(), t.z(), q.w(), q.x(), q.y(), q.z()});
      text += '\n';
      return;
    case TrajectoryFormat::kKitti: {
      const Eigen::Matrix3d r = q.toRotationMatrix();
      for (int i = 0; i < 3; ++i) {
        fmt::format_to(std::back_inserter(text),
                       "{:.9e} {:.9e} {:.9e} {:.9e}{}",
                       unsigned_zero(r(i, 0)),
                       unsigned_zero(r(i, 1)),
                       unsigned_zero(r(i, 2)),
                       unsigned_zero(t(i)),
                       i < 2 ? ' ' : '\n');
      }
      return;
    }
  }
}

TrajectoryFormat recognize_format(std::string_view text, const std::string& name) {
  RowReader rows(text, name, ' ');
  if (!rows.next())
    throw InputError(name, "holds no pose, expected rows in TUM, EuRoC or KITTI format");
  const bool has_comma = std::any_of(rows.fields().begin(), rows.fields().end(), [](auto field) {
    return field.find(',') != std::string_view::npos;
  });
  if (has_comma) return TrajectoryFormat::kEuroc;
  if (rows.fields().size() == 8) return TrajectoryFormat::kTum;
  if (rows.fields().size() == 12) return TrajectoryFormat::kKitti;
  throw InputError(rows.where(),
                   fmt::format("{} fields, expected 8 (TUM), 12 (KITTI) or commas (EuRoC)",
                               rows.fields().size()));
}

/// times.txt of a file of KITTI poses; empty where there is none.
std::filesystem::path find_times(const std::filesystem::path& poses_path) {
  const std::filesystem::path folder = poses_path.parent_path();
  const std::array<std::filesystem::path, 2> candidates = {
      folder / "times.txt", folder / ".." / "sequences" / poses_path.stem() / "times.txt"};
  for (const std::filesystem::path& candidate : candidates) {
    if (std::filesystem::is_regular_file(candidate)) return candidate;
  }
  return {};
}

std::string read_poses_file(const std::filesystem::path& path) {
  return read_text_file(path, "a trajectory in TUM, EuRoC or KITTI format");
}

/// With the number of the line for a time in seconds.
std::vector<StampedPose> numbered(const std::vector<Rigid3>& poses) {
  std::vector<StampedPose> trajectory;
  for (const Rigid3& pose : poses) {
    trajectory.push_back({static_cast<std::int64_t>(trajectory.size()) * 1'000'000'000, pose});
  }
  return trajectory;
}

std::vector<StampedPose> read_kitti(const std::filesystem::path& path,
                                    std::string_view text,
                                    const std::optional<std::filesystem::path>& times_path) {
  const std::vector<Rigid3> poses = parse_kitti_poses(text, path.string());
  const std::filesystem::path times_file = times_path ? *times_path : find_times(path);
  if (times_file.empty()) {
    throw InputError(path.string(), "KITTI poses carry no time, expected times.txt beside them");
  }
  const std::string times_text = read_text_file(times_file, "one time in seconds per pose");
  const std::vector<std::int64_t> times_ns = parse_times(times_text, times_file.string());
  if (times_ns.size() != poses.size()) {
    throw InputError(times_file.string(),
                     fmt::format("{} times, expected {}: one per pose of {}",
                                 times_ns.size(),
                                 poses.size(),
                                 path.string()));
  }
  std::vector<StampedPose> trajectory(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) trajectory[i] = {times_ns[i], poses[i]};
  return trajectory;
}

}  // namespace

std::string_view to_string(TrajectoryFormat format) {
  switch (format) {
    case TrajectoryFormat::kTum:
      return "tum";
    case TrajectoryFormat::kKitti:
      return "kitti";
    case TrajectoryFormat::kEuroc:
      return "euroc";
  }
  fail_check("known TrajectoryFormat", __FILE__, __LINE__);
}

std::string format_trajectory(std::span<const StampedPose> poses, TrajectoryFormat format) {
  std::string text = format == TrajectoryFormat::kEuroc ? kEurocHeader : "";
  for (const StampedPose& pose : poses) append_pose(text, pose, format);
  return text;
}

void write_trajectory(const std::filesystem::path& path,
                      std::span<const StampedPose> poses,
                      TrajectoryFormat format) {
  write_file_atomically(path, format_trajectory(poses, format));
}

std::vector<StampedPose> parse_tum_trajectory(std::string_view text, const std::string& name) {
  std::vector<StampedPose> poses;
  const TimeColumn column(text, ' ');
  RowReader rows(text, name, ' ');
  while (rows.next()) {
    rows.expect_exactly(8, kTumLayout);
    const Eigen::Quaterniond rotation(
        rows.number(7), rows.number(4), rows.number(5), rows.number(6));
    poses.push_back({column.read(rows), {checked_rotation(rows, rotation), read_position(rows)}});
  }
  return poses;
}

std::vector<StampedPose> parse_euroc_trajectory(std::string_view text, const std::string& name) {
  std::vector<StampedPose> poses;
  RowReader rows(text, name, ',');
  while (rows.next()) {
    rows.expect_at_least(8, kEurocLayout);
    const Eigen::Quaterniond rotation(
        rows.number(4), rows.number(5), rows.number(6), rows.number(7));
    poses.push_back({rows.nanoseconds(0), {checked_rotation(rows, rotation), read_position(rows)}});
  }
  return poses;
}

std::vector<Rigid3> parse_kitti_poses(std::string_view text, const std::string& name) {
  std::vector<Rigid3> poses;
  RowReader rows(text, name, ' ');
  while (rows.next()) {
    rows.expect_exactly(12, kKittiLayout);
    Eigen::Matrix<double, 3, 4> matrix;
    for (int i = 0; i < 12; ++i) matrix(i / 4, i % 4) = rows.number(static_cast<std::size_t>(i));
    poses.push_back({checked_rotation(rows, Eigen::Matrix3d(matrix.leftCols<3>())), matrix.col(3)});
  }
  return poses;
}

std::vector<StampedPose> read_trajectory(const std::filesystem::path& path,
                                         const std::optional<std::filesystem::path>& times_path) {
  const std::string text = read_poses_file(path);
  std::vector<StampedPose> poses;
  switch (recognize_format(text, path.string())) {
    case TrajectoryFormat::kTum:
      poses = parse_tum_trajectory(text, path.string());
      break;
    case TrajectoryFormat::kEuroc: {
      poses = parse_euroc_trajectory(text, path.string());
      const Rigid3 sensor_from_camera = euroc_sensor_from_camera0(path);
      for (StampedPose& pose : poses)
        pose.world_from_camera = pose.world_from_camera * sensor_from_camera;
      break;
    }
    case TrajectoryFormat::kKitti:
      poses = read_kitti(path, text, times_path);
      break;
  }
  std::stable_sort(poses.begin(), poses.end(), [](const StampedPose& a, const StampedPose& b) {
    return a.timestamp_ns < b.timestamp_ns;
  });
  return poses;
}

TrajectoryPair read_trajectories(const std::filesystem::path& estimate,
                                 const std::filesystem::path& groundtruth) {
  const std::array texts = {read_poses_file(estimate), read_poses_file(groundtruth)};
  const bool are_kitti =
      recognize_format(texts[0], estimate.string()) == TrajectoryFormat::kKitti &&
      recognize_format(texts[1], groundtruth.string()) == TrajectoryFormat::kKitti;
  if (!are_kitti || (!find_times(estimate).empty() && !find_times(groundtruth).empty())) {
    return {read_trajectory(estimate), read_trajectory(groundtruth), false};
  }
  const std::vector<Rigid3> poses = parse_kitti_poses(texts[0], estimate.string());
  const std::vector<Rigid3> true_poses = parse_kitti_poses(texts[1], groundtruth.string());
  if (poses.size() != true_poses.size()) {
    throw InputError(estimate.string(),
                     fmt::format("{} poses without times, expected {} as in {}",
                                 poses.size(),
                                 true_poses.size(),
                                 groundtruth.string()));
  }
  return {numbered(poses), numbered(true_poses), true};
}

}  // namespace waymark

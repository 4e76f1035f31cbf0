// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/larger_motion.h"

#include <algorithm>
#include <array>
#include <map>

#include "waymark/base/median.h"

namespace waymark {
namespace {

/// A second motion is one that so many of the other observations share, and such a part of them:
/// noise and wrong matches do not agree.
constexpr double kMinOfOtherMotion = 30.0;
constexpr double kMinPartOfOthers = 0.75;
/// How much more of the surface it must explain.
constexpr double kMinSurfaceRatio = 1.05;
/// Ranges count up to so many medians, as the farthest are hardly known.
constexpr double kMaxRangeOfMedian = 3.0;
/// Observations within about so many radians of each other show the same surface.
constexpr float kCellRad = 0.1f;
constexpr double kContradictedChi2 = 4.0 * PoseOptions{}.gate_chi2;

std::array<int, 3> cell_of(const Eigen::Vector3f& bearing) {
  const Eigen::Vector3i cell = (bearing / kCellRad).array().floor().cast<int>();
  return {cell.x(), cell.y(), cell.z()};
}

}  // namespace

std::optional<Rigid3> LargerMotion::find(const PoseObservations& observations,
                                         const Rigid3& initial_rig_from_world,
                                         const PoseEstimate& first) {
  const auto num_others = static_cast<double>(observations.size() - first.num_inliers);
  if (num_others < kMinOfOtherMotion) return std::nullopt;
  others_.clear();
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (!first.is_inlier[i]) others_.add(observations, i);
  }
  const PoseEstimate other =
      optimize_pose(*rig_, others_, initial_rig_from_world, PoseOptions{}, workspace_);
  const double enough = std::max(kMinOfOtherMotion, kMinPartOfOthers * num_others);
  if (static_cast<double>(other.num_inliers) < enough) return std::nullopt;
  const double by_first = explained_surface(observations, first.rig_from_world);
  const double by_other = explained_surface(observations, other.rig_from_world);
  return by_other > kMinSurfaceRatio * by_first ? std::optional(other.rig_from_world)
                                                : std::nullopt;
}

bool LargerMotion::is_contradicted(const PoseObservations& observations,
                                   std::size_t index,
                                   const Rigid3& rig_from_world) const {
  return squared_error(observations, index, rig_from_world) > kContradictedChi2;
}

double LargerMotion::squared_error(const PoseObservations& observations,
                                   std::size_t index,
                                   const Rigid3& rig_from_world) const {
  const Eigen::Vector3d point =
      rig_->cameras[0].cam_from_rig * (rig_from_world * observations.point_in_world[index]);
  const Eigen::Vector3f off = point.normalized().cast<float>() - observations.bearing[index];
  return (observations.level_pixel_from_bearing[index] * off).squaredNorm();
}

double LargerMotion::explained_surface(const PoseObservations& observations,
                                       const Rigid3& rig_from_world) {
  ranges_.clear();
  for (const Eigen::Vector3d& point : observations.point_in_world) {
    ranges_.push_back((rig_from_world * point).norm());
  }
  sorted_ranges_ = ranges_;
  const double farthest = kMaxRangeOfMedian * median(sorted_ranges_);
  struct Cell {
    double surface = 0.0;
    int count = 0;
  };
  std::map<std::array<int, 3>, Cell> cells;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const double fit =
        1.0 - squared_error(observations, i, rig_from_world) / PoseOptions{}.gate_chi2;
    const double range = std::min(ranges_[i], farthest);
    Cell& cell = cells[cell_of(observations.bearing[i])];
    cell.surface += std::max(0.0, fit) * range * range;
    ++cell.count;
  }
  double sum = 0.0;
  for (const auto& [place, cell] : cells) sum += cell.surface / cell.count;
  return sum;
}

}  // namespace waymark

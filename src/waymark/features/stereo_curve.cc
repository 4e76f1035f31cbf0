// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/stereo_curve.h"

#include <cmath>

#include "waymark/base/check.h"

namespace waymark {
namespace {

/// A ray that passes camera 1 closer than that has no curve: it points at the epipole.
constexpr double kMinBaselineShare = 1e-3;

}  // namespace

EpipolarRay::EpipolarRay(const Rigid3& cam1_from_cam0, const Eigen::Vector3d& bearing0)
    : infinity(cam1_from_cam0.rotation * bearing0) {
  const Eigen::Vector3d& baseline = cam1_from_cam0.translation;
  baseline_along_m = baseline.dot(infinity);
  const Eigen::Vector3d across = baseline - baseline_along_m * infinity;
  baseline_across_m = across.norm();
  toward = baseline_across_m > kMinBaselineShare * baseline.norm()
               ? Eigen::Vector3d(across / baseline_across_m)
               : Eigen::Vector3d::Zero();
}

Eigen::Vector3d EpipolarRay::direction(double angle_rad) const {
  return std::cos(angle_rad) * infinity + std::sin(angle_rad) * toward;
}

Eigen::Vector3d EpipolarRay::direction_derivative(double angle_rad) const {
  return std::cos(angle_rad) * toward - std::sin(angle_rad) * infinity;
}

double EpipolarRay::angle(double inverse_range) const {
  return std::atan2(inverse_range * baseline_across_m, 1.0 + inverse_range * baseline_along_m);
}

double EpipolarRay::inverse_range(double angle_rad) const {
  const double sine = std::sin(angle_rad);
  return sine / (baseline_across_m * std::cos(angle_rad) - baseline_along_m * sine);
}

EpipolarCurves::EpipolarCurves(const Rig& rig, double min_range_m)
    : camera1_(rig.cameras[1].camera),
      cam1_from_cam0_(rig.cameras[1].cam_from_rig * rig.cameras[0].cam_from_rig.inverse()),
      max_inverse_range_(1.0 / min_range_m) {}

void EpipolarCurves::compute(std::span<const Eigen::Vector3f> bearings0,
                             std::span<const float> size_rad) {
  WAYMARK_CHECK(size_rad.size() == bearings0.size());
  rays_.clear();
  angles_.clear();
  directions_.clear();
  direction_begin_.assign(1, 0);
  for (std::size_t i = 0; i < bearings0.size(); ++i) {
    rays_.emplace_back(cam1_from_cam0_, bearings0[i].cast<double>().normalized());
    add_directions(rays_.back(), size_rad[i]);
    direction_begin_.push_back(directions_.size());
  }
  pixels_.resize(directions_.size());
  is_visible_.resize(directions_.size());
  camera1_->project(directions_, pixels_, is_visible_);

  nodes_.clear();
  node_begin_.assign(1, 0);
  for (std::size_t i = 0; i < bearings0.size(); ++i) {
    keep_longest_run(direction_begin_[i], direction_begin_[i + 1]);
    node_begin_.push_back(nodes_.size());
  }
}

std::span<const CurveNode> EpipolarCurves::nodes(std::size_t feature) const {
  return std::span(nodes_).subspan(node_begin_[feature],
                                   node_begin_[feature + 1] - node_begin_[feature]);
}

void EpipolarCurves::add_directions(const EpipolarRay& ray, double size_rad) {
  if (ray.toward.isZero()) return;
  const double first = -kBehindInfinityPx * size_rad;
  const double last = ray.angle(max_inverse_range_);
  const int num_steps = static_cast<int>(std::ceil((last - first) / (kNodeDistancePx * size_rad)));
  // One rotation by the step after the other; sine and cosine per node would cost as much as the
  // projection.
  const double step_rad = (last - first) / num_steps;
  const double cosine = std::cos(step_rad);
  const double sine = std::sin(step_rad);
  double along = std::cos(first);
  double across = std::sin(first);
  for (int step = 0; step <= num_steps; ++step) {
    angles_.push_back(first + step * step_rad);
    directions_.push_back(along * ray.infinity + across * ray.toward);
    const double next_along = cosine * along - sine * across;
    across = sine * along + cosine * across;
    along = next_along;
  }
}

/// A curve may leave the image and come back, or cross the seam of a 360 degree image.
void EpipolarCurves::keep_longest_run(std::size_t begin, std::size_t end) {
  const double seam_px = 0.5 * camera1_->wrap_width_px();
  std::size_t best_begin = begin;
  std::size_t best_end = begin;
  std::size_t run_begin = begin;
  for (std::size_t i = begin; i < end; ++i) {
    const bool crosses_seam =
        i > run_begin && seam_px > 0.0 && std::abs(pixels_[i].x() - pixels_[i - 1].x()) > seam_px;
    if (!is_visible_[i]) {
      run_begin = i + 1;
      continue;
    }
    if (crosses_seam) run_begin = i;
    if (i + 1 - run_begin > best_end - best_begin) {
      best_begin = run_begin;
      best_end = i + 1;
    }
  }
  for (std::size_t i = best_begin; i < best_end; ++i) {
    nodes_.push_back({angles_[i], pixels_[i]});
  }
}

}  // namespace waymark

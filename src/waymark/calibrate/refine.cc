// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/calibrate/refine.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "waymark/features/pyramid.h"
#include "waymark/geometry/damping.h"
#include "waymark/geometry/robust_loss.h"
#include "waymark/solver/residual.h"

namespace waymark {
namespace {

constexpr std::size_t kMinKeyframes = 5;
constexpr std::size_t kMaxKeyframes = 100;
constexpr std::size_t kMinLandmarks = 100;
/// Landmarks of fewer keyframes tell nothing of the lens.
constexpr std::size_t kMinObservations = 3;
constexpr double kHuberPx = 1.0;
constexpr double kGatePx = 2.45;
constexpr int kMaxIterations = 40;
constexpr double kCostTolerance = 1e-6;
constexpr int kLensSize = 6;
using Matrix26d = Eigen::Matrix<double, 2, 6>;
using Matrix63d = Eigen::Matrix<double, 6, 3>;

/// One landmark in one keyframe.
struct LensObservation {
  int pose = 0;
  Eigen::Vector2d pixel;
  float level_scale = 1.0f;
};

/// A landmark and where it is seen.
struct LensPoint {
  std::vector<LensObservation> observations;
  std::size_t first = 0;  ///< Of its observations, among those of all points.
};

/// What is looked for.
struct LensState {
  std::vector<Rigid3> cam_from_world;
  std::vector<Eigen::Vector3d> points;
  LensChange change = LensChange::Zero();
};

/// Keyframes of the sub-map that has most, the first of them, ascending.
std::vector<KeyframeId> keyframes_of_largest(const Map& map) {
  std::map<SubmapId, std::vector<KeyframeId>> keyframes;
  map.keyframes().for_each(
      [&](KeyframeId id, const Keyframe& keyframe) { keyframes[keyframe.submap].push_back(id); });
  std::vector<KeyframeId> largest;
  for (auto& [submap, ids] : keyframes) {
    if (ids.size() > largest.size()) largest = std::move(ids);
  }
  if (largest.size() > kMaxKeyframes) largest.resize(kMaxKeyframes);
  return largest;
}

/// The least-squares problem of a map: observations, and residuals at a state.
class LensProblem {
 public:
  LensProblem(const Map& map,
              const CameraDescription& assumed,
              const CameraDescription& lens,
              double focal_sigma);

  bool is_large_enough() const {
    return state.cam_from_world.size() >= kMinKeyframes && points_.size() >= kMinLandmarks;
  }
  /// Moves the state to the least cost and gives that; infinite where there is no such lens.
  double minimize();
  void drop_outliers();
  /// Standard deviations of the numbers of the lens, in units of the residuals' noise.
  LensChange deviations();
  /// Squared noise of the residuals.
  double variance(double cost) const;

  LensState state;

 private:
  struct Elimination {
    Eigen::MatrixXd matrix;  ///< Of poses, then lens; points eliminated.
    Eigen::VectorXd right;
    std::vector<Eigen::Matrix3d> point_inverse;
    std::vector<Eigen::Vector3d> point_right;
    std::vector<std::vector<Matrix63d>> pose_by_point;
    std::vector<Matrix63d> lens_by_point;
  };

  bool predict(const LensState& at);
  void differentiate_by_lens();
  double cost() const;
  Elimination eliminate(double damping) const;
  LensState moved(const Elimination& elimination, const Eigen::VectorXd& step) const;
  void add_point(std::size_t index, double damping, Elimination& elimination) const;

  const CameraDescription assumed_;
  const LensChange sigmas_;  ///< Of the truth around what is assumed.
  std::vector<LensPoint> points_;
  // At the state predicted last, all observations in order.
  LensChange change_;
  std::vector<Eigen::Vector3d> points_in_cam_;
  std::vector<Eigen::Vector2d> errors_;  ///< Predicted - measured, px of the level.
  std::vector<Matrix23d> error_by_point_;
  std::vector<Matrix26d> error_by_lens_;
  std::vector<std::uint8_t> is_visible_;
};

/// Of a lens relative to what is assumed of it.
LensChange change_of(const CameraDescription& assumed, const CameraDescription& lens) {
  const auto& a = assumed.intrinsics;
  const auto& b = lens.intrinsics;
  LensChange change;
  change << std::log(b[0] / a[0]), std::log(b[1] / b[0]) - std::log(a[1] / a[0]), b[2] - a[2],
      b[3] - a[3], lens.distortion_coeffs[0] - assumed.distortion_coeffs[0],
      lens.distortion_coeffs[1] - assumed.distortion_coeffs[1];
  return change;
}

LensProblem::LensProblem(const Map& map,
                         const CameraDescription& assumed,
                         const CameraDescription& lens,
                         double focal_sigma)
    : assumed_(assumed), sigmas_(lens_sigmas(assumed.width_px, focal_sigma)) {
  state.change = change_of(assumed, lens);
  const std::vector<KeyframeId> keyframes = keyframes_of_largest(map);
  for (const KeyframeId id : keyframes) {
    state.cam_from_world.push_back(map.keyframes().at(id).rig_from_world);
  }
  map.landmarks().for_each([&](LandmarkId, const Landmark& landmark) {
    LensPoint point;
    for (const Observation& seen : landmark.observations) {
      const auto at = std::lower_bound(keyframes.begin(), keyframes.end(), seen.keyframe);
      if (at == keyframes.end() || *at != seen.keyframe) continue;
      const Features& features = *map.keyframes().at(seen.keyframe).features;
      if (features.is_edge(seen.feature)) continue;
      const Keypoint& keypoint = features.keypoints[seen.feature];
      point.observations.push_back({static_cast<int>(at - keyframes.begin()),
                                    {keypoint.x_px, keypoint.y_px},
                                    static_cast<float>(Pyramid::scale(keypoint.level))});
    }
    if (point.observations.size() < kMinObservations) return;
    points_.push_back(std::move(point));
    state.points.push_back(landmark.position_in_world);
  });
}

/// Errors and their derivatives by the points; whether there is such a lens.
bool LensProblem::predict(const LensState& at) {
  const auto lens = changed(assumed_, at.change);
  if (!lens) return false;
  change_ = at.change;
  points_in_cam_.clear();
  for (std::size_t i = 0; i < points_.size(); ++i) {
    points_[i].first = points_in_cam_.size();
    for (const LensObservation& observation : points_[i].observations) {
      points_in_cam_.push_back(at.cam_from_world[static_cast<std::size_t>(observation.pose)] *
                               at.points[i]);
    }
  }
  const std::size_t count = points_in_cam_.size();
  errors_.resize(count);
  error_by_point_.resize(count);
  is_visible_.resize(count);
  lens->camera->project_with_jacobian(points_in_cam_, errors_, error_by_point_, is_visible_);
  std::size_t k = 0;
  for (const LensPoint& point : points_) {
    for (const LensObservation& observation : point.observations) {
      errors_[k] = (errors_[k] - observation.pixel) / observation.level_scale;
      error_by_point_[k++] /= observation.level_scale;
    }
  }
  return true;
}

/// By central differences, at the state predicted last.
void LensProblem::differentiate_by_lens() {
  const std::size_t count = points_in_cam_.size();
  const LensChange steps = 1e-3 * sigmas_;
  error_by_lens_.assign(count, Matrix26d::Zero());
  std::vector<Eigen::Vector2d> below(count), above(count);
  std::vector<std::uint8_t> is_below(count), is_above(count);
  for (int column = 0; column < kLensSize; ++column) {
    const LensChange step = steps[column] * LensChange::Unit(column);
    const auto lens_below = changed(assumed_, change_ - step);
    const auto lens_above = changed(assumed_, change_ + step);
    if (!lens_below || !lens_above) continue;
    lens_below->camera->project(points_in_cam_, below, is_below);
    lens_above->camera->project(points_in_cam_, above, is_above);
    std::size_t k = 0;
    for (const LensPoint& point : points_) {
      for (const LensObservation& observation : point.observations) {
        if (is_below[k] && is_above[k]) {
          error_by_lens_[k].col(column) =
              (above[k] - below[k]) / (2.0 * steps[column] * observation.level_scale);
        }
        ++k;
      }
    }
  }
}

double LensProblem::cost() const {
  double sum = change_.cwiseQuotient(sigmas_).squaredNorm();
  for (std::size_t k = 0; k < errors_.size(); ++k) {
    // What cannot be seen costs as much as what is far off, and pulls nothing.
    sum += huber(is_visible_[k] ? errors_[k].squaredNorm() : kGrossSquaredResidual, kHuberPx).loss;
  }
  return 0.5 * sum;
}

void LensProblem::add_point(std::size_t index, double damping, Elimination& system) const {
  const LensPoint& point = points_[index];
  const auto lens_at = static_cast<Eigen::Index>(6 * state.cam_from_world.size());
  Eigen::Matrix3d points = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  std::vector<Matrix63d>& by_pose = system.pose_by_point[index];
  Matrix63d& by_lens = system.lens_by_point[index];
  by_pose.assign(point.observations.size(), Matrix63d::Zero());
  by_lens.setZero();
  for (std::size_t k = 0; k < point.observations.size(); ++k) {
    const std::size_t observation = point.first + k;
    if (!is_visible_[observation]) continue;
    const Eigen::Vector2d& error = errors_[observation];
    const double weight = huber(error.squaredNorm(), kHuberPx).weight;
    const Matrix23d& by_camera_point = error_by_point_[observation];
    const Matrix23d by_point =
        by_camera_point * state.cam_from_world[static_cast<std::size_t>(point.observations[k].pose)]
                              .rotation_matrix();
    Matrix26d pose;
    pose << by_camera_point, -by_camera_point * skew(points_in_cam_[observation]);
    const Matrix26d& lens = error_by_lens_[observation];
    const Eigen::Index at = 6 * point.observations[k].pose;
    system.matrix.block<6, 6>(at, at) += weight * pose.transpose() * pose;
    system.matrix.block<6, 6>(lens_at, at) += weight * lens.transpose() * pose;
    system.matrix.block<6, 6>(lens_at, lens_at) += weight * lens.transpose() * lens;
    system.right.segment<6>(at) -= weight * pose.transpose() * error;
    system.right.segment<6>(lens_at) -= weight * lens.transpose() * error;
    by_pose[k] = weight * pose.transpose() * by_point;
    by_lens += weight * lens.transpose() * by_point;
    points += weight * by_point.transpose() * by_point;
    right -= weight * by_point.transpose() * error;
  }
  points.diagonal() += damping * points.diagonal() + Eigen::Vector3d::Constant(1e-12);
  const Eigen::Matrix3d inverse = points.inverse();
  system.point_inverse[index] = inverse;
  system.point_right[index] = right;
  for (std::size_t k = 0; k < point.observations.size(); ++k) {
    const Eigen::Index at = 6 * point.observations[k].pose;
    const Matrix63d eliminated = by_pose[k] * inverse;
    for (std::size_t l = 0; l < point.observations.size(); ++l) {
      const Eigen::Index other = 6 * point.observations[l].pose;
      if (other > at) continue;
      system.matrix.block<6, 6>(at, other) -= eliminated * by_pose[l].transpose();
    }
    system.matrix.block<6, 6>(lens_at, at) -= by_lens * eliminated.transpose();
    system.right.segment<6>(at) -= eliminated * right;
  }
  system.matrix.block<6, 6>(lens_at, lens_at) -= by_lens * inverse * by_lens.transpose();
  system.right.segment<6>(lens_at) -= by_lens * inverse * right;
}

LensProblem::Elimination LensProblem::eliminate(double damping) const {
  const auto lens_at = static_cast<Eigen::Index>(6 * state.cam_from_world.size());
  const auto size = lens_at + kLensSize;
  Elimination system;
  system.matrix = Eigen::MatrixXd::Zero(size, size);
  system.right = Eigen::VectorXd::Zero(size);
  system.point_inverse.resize(points_.size());
  system.point_right.resize(points_.size());
  system.pose_by_point.resize(points_.size());
  system.lens_by_point.resize(points_.size());
  for (int k = 0; k < kLensSize; ++k) {
    system.matrix(lens_at + k, lens_at + k) += 1.0 / (sigmas_[k] * sigmas_[k]);
    system.right[lens_at + k] -= state.change[k] / (sigmas_[k] * sigmas_[k]);
  }
  for (std::size_t i = 0; i < points_.size(); ++i) add_point(i, damping, system);
  // The first pose holds the gauge; the scale is held by damping.
  system.matrix.topRows<6>().setZero();
  system.matrix.leftCols<6>().setZero();
  system.matrix.topLeftCorner<6, 6>().setIdentity();
  system.right.head<6>().setZero();
  system.matrix.diagonal() *= 1.0 + damping;
  return system;
}

LensState LensProblem::moved(const Elimination& system, const Eigen::VectorXd& step) const {
  LensState to = state;
  const LensChange of_lens = step.tail<kLensSize>();
  to.change += of_lens;
  for (std::size_t i = 0; i < to.cam_from_world.size(); ++i) {
    to.cam_from_world[i] =
        Rigid3::exp(step.segment<6>(static_cast<Eigen::Index>(6 * i))) * to.cam_from_world[i];
  }
  for (std::size_t i = 0; i < points_.size(); ++i) {
    Eigen::Vector3d right = system.point_right[i] - system.lens_by_point[i].transpose() * of_lens;
    for (std::size_t k = 0; k < points_[i].observations.size(); ++k) {
      right -= system.pose_by_point[i][k].transpose() *
               step.segment<6>(6 * points_[i].observations[k].pose);
    }
    to.points[i] += system.point_inverse[i] * right;
  }
  return to;
}

double LensProblem::minimize() {
  TenfoldDamping damping;
  if (!predict(state)) return std::numeric_limits<double>::infinity();
  differentiate_by_lens();
  double least = cost();
  for (int i = 0; i < kMaxIterations && damping.is_below(1e6); ++i) {
    const Elimination system = eliminate(damping.value());
    const Eigen::VectorXd step =
        system.matrix.selfadjointView<Eigen::Lower>().ldlt().solve(system.right);
    const LensState to = moved(system, step);
    const bool is_possible = step.allFinite() && predict(to);
    const double next = is_possible ? cost() : std::numeric_limits<double>::infinity();
    if (!(next < least)) {
      damping.reject();
      predict(state);
      continue;
    }
    const bool is_converged = next > (1.0 - kCostTolerance) * least;
    state = to;
    least = next;
    differentiate_by_lens();
    damping.accept();
    if (is_converged) break;
  }
  return least;
}

void LensProblem::drop_outliers() {
  std::size_t count = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    LensPoint kept;
    for (std::size_t k = 0; k < points_[i].observations.size(); ++k) {
      const std::size_t observation = points_[i].first + k;
      if (!is_visible_[observation] || errors_[observation].norm() > kGatePx) continue;
      kept.observations.push_back(points_[i].observations[k]);
    }
    if (kept.observations.size() < kMinObservations) continue;
    points_[count] = std::move(kept);
    state.points[count++] = state.points[i];
  }
  points_.resize(count);
  state.points.resize(count);
}

double LensProblem::variance(double cost) const {
  const double freedom = 2.0 * static_cast<double>(errors_.size()) -
                         3.0 * static_cast<double>(points_.size()) -
                         6.0 * static_cast<double>(state.cam_from_world.size());
  return 2.0 * cost / std::max(freedom, 1.0);
}

LensChange LensProblem::deviations() {
  const Elimination system = eliminate(1e-9);
  const auto factors = system.matrix.selfadjointView<Eigen::Lower>().ldlt();
  LensChange sigmas;
  for (int k = 0; k < kLensSize; ++k) {
    const Eigen::Index at = system.right.size() - kLensSize + k;
    sigmas[k] = std::sqrt(factors.solve(Eigen::VectorXd::Unit(system.right.size(), at))[at]);
  }
  return sigmas;
}

}  // namespace

std::optional<RefinedLens> refine_lens(const Map& map,
                                       const CameraDescription& assumed,
                                       const CameraDescription& lens,
                                       double focal_sigma) {
  LensProblem problem(map, assumed, lens, focal_sigma);
  if (!problem.is_large_enough()) return std::nullopt;
  if (!std::isfinite(problem.minimize())) return std::nullopt;
  problem.drop_outliers();
  if (!problem.is_large_enough()) return std::nullopt;
  const double variance = problem.variance(problem.minimize());
  const auto made = changed(assumed, problem.state.change);
  if (!made || !std::isfinite(variance)) return std::nullopt;
  RefinedLens refined;
  refined.description = made->description;
  refined.sigmas = std::sqrt(variance) * problem.deviations();
  refined.reprojection_px = std::sqrt(variance);
  refined.num_keyframes = problem.state.cam_from_world.size();
  return refined;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <type_traits>
#include <utility>

#include "waymark/solver/schur_equations.h"

namespace waymark {
namespace {

/// Of matrices one behind the other.
template <class Matrices>
auto numbers(Matrices& matrices) {
  using Matrix = typename Matrices::value_type;
  using Number = std::conditional_t<std::is_const_v<Matrices>, const double, double>;
  static_assert(std::is_same_v<Matrix, RigidMatrix> ? sizeof(Matrix) == 12 * sizeof(double)
                                                    : sizeof(Matrix) % sizeof(double) == 0);
  return reinterpret_cast<Number*>(matrices.data());
}

}  // namespace

void SchurSolver::list_cameras() {
  std::vector<std::pair<const Rig*, std::size_t>> listed;
  for (const Rig* rig : problem_.rigs) {
    auto at = std::find_if(
        listed.begin(), listed.end(), [&](const auto& entry) { return entry.first == rig; });
    if (at == listed.end()) {
      at = listed.insert(at, {rig, state_.cameras.size()});
      for (const RigCamera& camera : rig->cameras)
        state_.cameras.push_back(matrix_of(camera.cam_from_rig));
    }
    first_camera_.push_back(at->second);
  }
}

Eigen::Vector2d SchurSolver::residual_of(std::size_t i,
                                         const InverseRangePoint& seen,
                                         const BundleState& state) const {
  const BundleObservation& observation = problem_.observations[i];
  Eigen::Vector2d residual =
      bearing_residual(seen, observation.bearing, observation.level_pixel_from_bearing);
  if (const BundleCalibration* calibration = problem_.calibration_of(observation.pose)) {
    residual += calibration->pixel_shift(i, observation.camera, state.calibration);
  }
  return residual;
}

double SchurSolver::range_residual_of(std::size_t i,
                                      const InverseRangePoint& seen,
                                      const BundleState& state) const {
  const BundleObservation& observation = problem_.observations[i];
  const double sigma = observation.inverse_range_sigma;
  const BundleCalibration* calibration = problem_.calibration_of(observation.pose);
  const double shift = calibration ? calibration->inverse_range_shift(i, state.calibration) : 0.0;
  const auto residual = has_depth(observation) ? depth_residual : range_residual;
  return residual(seen, observation.inverse_range - shift, sigma);
}

/// Of one observation, twice.
double SchurSolver::loss(std::size_t i, const BundleState& state) const {
  const BundleObservation& observation = problem_.observations[i];
  const Eigen::Vector3d point_in_rig =
      apply(state.matrices[observation.pose], state.points[observation.point]);
  const InverseRangePoint seen =
      in_inverse_range(apply(camera_of(observation, state), point_in_rig));
  if (!is_ahead(seen, observation.bearing)) {
    return huber(kGrossSquaredResidual, options_.huber_px).loss;
  }
  double sum = huber(residual_of(i, seen, state).squaredNorm(), options_.huber_px).loss;
  if (observation.inverse_range_sigma > 0.0f) {
    const double range = range_residual_of(i, seen, state);
    sum += huber(range * range, options_.range_huber).loss;
  }
  return sum;
}

BundlePlaces SchurSolver::places_of(const BundleState& state) {
  return {numbers(state.matrices), numbers(state.cameras), numbers(state.points)};
}

double SchurSolver::cost(const BundleState& state) {
  double sum = sum_over(plan_.observations.size(), [&](std::size_t begin, std::size_t end) {
    if (!border_) {
      const BundleLoss loss{options_.huber_px, options_.range_huber};
      return sum_bundle_losses(arrays_, places_of(state), loss, begin, end);
    }
    double part = 0.0;
    for (std::size_t k = begin; k < end; ++k) part += loss(plan_.observations[k], state);
    return part;
  });
  if (border_) {
    const Eigen::VectorXd off = state.calibration - problem_.calibration->prior_change;
    sum += off.dot(problem_.calibration->prior_information * off);
  }
  return 0.5 * (sum + motion_cost(state));
}

/// Of the rows of observation i; in place, since it is large to return.
template <int kRows>
void SchurSolver::set_by_calibration(const ResidualRows<kRows>& rows,
                                     std::size_t i,
                                     const Eigen::Vector3d& point_in_rig,
                                     ByCalibration& by) const {
  const BundleObservation& observation = problem_.observations[i];
  const BundleCalibration& calibration = *problem_.calibration;
  const CalibrationParameters::Block& block = calibration.blocks[observation.camera];
  by.setZero(static_cast<Eigen::Index>(block.size()), kRows);
  const auto by_intrinsics = calibration.by_intrinsics(i, observation.camera);
  const Eigen::Index num_intrinsics = by_intrinsics.cols();
  by.topLeftCorner(num_intrinsics, 2) =
      rows.bearing_root * by_intrinsics.transpose().template cast<double>();
  if constexpr (kRows == 3) {
    const auto by_range = calibration.inverse_range_by(i);
    by.col(2).head(by_range.cols()) =
        rows.range_scale * by_range.transpose().template cast<double>();
  }
  if (!block.has_extrinsics) return;
  const Eigen::Vector3d& baseline =
      calibration.rig->cameras[observation.camera].cam_from_rig.translation;
  const Eigen::Vector3d point_in_cam = apply(camera_of(observation, state_), point_in_rig);
  const Eigen::Matrix<double, 3, 2> across = baseline.norm() * across_baseline(baseline);
  for (int row = 0; row < kRows; ++row) {
    const Eigen::Vector3d gradient = rows.by_point_in_cam.row(row).transpose();
    by.block(num_intrinsics, row, 3, 1) = point_in_cam.cross(gradient);
    by.block(num_intrinsics + 3, row, 2, 1) = across.transpose() * gradient;
  }
}

template <int kRows>
void SchurSolver::accumulate(const ResidualRows<kRows>& rows,
                             std::size_t entry,
                             std::size_t k,
                             const Eigen::Vector3d& point_in_rig) {
  const BundleObservation& observation = problem_.observations[plan_.observations[k]];
  const Jacobians<kRows> by = jacobians(rows, plan_.observations[k], point_in_rig);
  blocks_.points[entry].noalias() += by.by_point.transpose() * by.by_point;
  blocks_.point_gradient[entry].noalias() += by.by_point.transpose() * rows.residual;
  const BundleCalibration* const calibration = problem_.calibration_of(observation.pose);
  const std::size_t first = calibration ? calibration->blocks[observation.camera].first : 0;
  if (calibration) border_->add(first, by.by_calibration, rows.residual, entry, by.by_point);
  const std::uint32_t link = plan_.link_of_observation[k];
  if (link == kNoSlot) return;
  const std::uint32_t slot = plan_.slot_of_link[link];
  blocks_.poses[slot].noalias() += by.by_pose.transpose() * by.by_pose;
  blocks_.pose_gradient[slot].noalias() += by.by_pose.transpose() * rows.residual;
  blocks_.links[link].noalias() += by.by_pose.transpose() * by.by_point;
  if (calibration) border_->add_pose(first, by.by_calibration, slot, by.by_pose);
}

void SchurSolver::linearize() {
  for (Matrix63d& link : blocks_.links) link.setZero();
  if (border_) return linearize_one_by_one();
  padded_poses_.assign(kPaddedPoseSize * plan_.num_slots, 0.0);
  sum_bundle_equations(arrays_,
                       places_of(state_),
                       {options_.huber_px, options_.range_huber},
                       {plan_.first_observation, plan_.link_of_observation, plan_.slot_of_link},
                       {padded_poses_.data(),
                        numbers(blocks_.points),
                        numbers(blocks_.point_gradient),
                        numbers(blocks_.links)});
  using Padded = Eigen::Map<const Eigen::Matrix<double, kPaddedPoseRows, 7>>;
  for (std::size_t slot = 0; slot < plan_.num_slots; ++slot) {
    const Padded sums(padded_poses_.data() + kPaddedPoseSize * slot);
    blocks_.poses[slot] << sums.topLeftCorner<3, 6>(), sums.block<3, 6>(4, 0);
    blocks_.pose_gradient[slot] << sums.col(6).head<3>(), sums.col(6).segment<3>(4);
  }
  add_motion();
}

void SchurSolver::linearize_one_by_one() {
  for (Matrix6d& block : blocks_.poses) block.setZero();
  for (Vector6d& gradient : blocks_.pose_gradient) gradient.setZero();
  border_->begin(*problem_.calibration, state_.calibration);
  for (std::size_t entry = 0; entry < plan_.points.size(); ++entry) {
    blocks_.points[entry].setZero();
    blocks_.point_gradient[entry].setZero();
    for (std::size_t k = plan_.first_observation[entry]; k < plan_.first_observation[entry + 1];
         ++k) {
      visit_rows(plan_.observations[k], [&](const auto& rows, const Eigen::Vector3d& point_in_rig) {
        accumulate(rows, entry, k, point_in_rig);
      });
    }
  }
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>
#include <span>
#include <vector>

#include "waymark/geometry/robust_loss.h"
#include "waymark/solver/bundle_kernel.h"
#include "waymark/solver/calibration_border.h"
#include "waymark/solver/residual.h"
#include "waymark/solver/schur_solver.h"

namespace waymark {

using Matrix63d = Eigen::Matrix<double, 6, 3>;

/// A Rigid3 with its rotation as a matrix, ready to be applied often.
struct RigidMatrix {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
};

inline RigidMatrix matrix_of(const Rigid3& pose) {
  return {pose.rotation_matrix(), pose.translation};
}

inline Eigen::Vector3d apply(const RigidMatrix& b_from_a, const Eigen::Vector3d& point_in_a) {
  Eigen::Vector3d point_in_b = b_from_a.translation;
  point_in_b.noalias() += b_from_a.rotation * point_in_a;
  return point_in_b;
}

/// What the solver moves.
struct BundleState {
  std::vector<Rigid3> rig_from_world;
  std::vector<RigidMatrix> matrices;  // The same.
  std::vector<Eigen::Vector3d> points;
  std::vector<RigidMatrix> cameras;  // Of each rig.
  Eigen::VectorXd calibration;       // Change of the parameters, where they are unknown.
  std::vector<Vector6d> unknowns;    // Of the motion.
};

/// Blocks of the normal equations H * step = -gradient.
struct NormalBlocks {
  std::vector<Matrix6d> poses;          // Per slot.
  std::vector<Vector6d> pose_gradient;  // Per slot.
  std::vector<Eigen::Matrix3d> points;  // Per entry of SchurStructure::points.
  std::vector<Eigen::Vector3d> point_gradient;
  /// Pose by point; eliminated ones times M^T. One more at the end is no link.
  std::vector<Matrix63d> links;
};

/// Residual rows of one observation (bearing, bearing, range) times the root of their weight.
template <int kRows>
struct ResidualRows {
  double bearing_root;  // Of the weight of the first two.
  double range_scale;   // Of the third: root of its weight over its standard deviation.
  Eigen::Matrix<double, kRows, 1> residual;
  Eigen::Matrix<double, kRows, 3> by_point_in_cam;
};

/// Points, or observations, that one thread works on at once.
inline constexpr std::size_t kNumPointsAtOnce = 4096;

/// Levenberg-Marquardt over one plan; see minimize_with_schur(), of which it is the inside.
class SchurSolver {
 public:
  SchurSolver(const BundleProblem& problem,
              std::span<const std::uint8_t> is_used,
              const BundleOptions& options)
      : problem_(problem),
        options_(options),
        plan_(make_schur_structure(problem, is_used)),
        threads_(options.num_threads),
        reduced_(plan_.num_slots, plan_.pattern) {
    state_.rig_from_world = problem.rig_from_world;
    state_.points = problem.points;
    for (const Rigid3& pose : state_.rig_from_world) state_.matrices.push_back(matrix_of(pose));
    list_cameras();
    if (problem.motion) state_.unknowns = problem.motion->unknowns;
    if (problem.calibration) {
      state_.calibration = problem.calibration->change;
      move_cameras(state_);
      border_.emplace(state_.calibration.size(), plan_.num_slots, plan_.points.size());
    }
    candidate_ = state_;
    allocate();
    // A calibration that is unknown is for one observation after the other.
    if (!border_) arrays_ = gather_bundle_observations(problem, plan_.observations, first_camera_);
  }

  BundleRound minimize();
  const BundleState& state() const { return state_; }
  /// What the state reached tells of the calibration; empty where the equations have no solution.
  CalibrationEvidence calibration_evidence();

 private:
  void list_cameras();
  /// Turns the cameras of the rig whose calibration is unknown.
  void move_cameras(BundleState& state) const;
  const RigidMatrix& camera_of(const BundleObservation& observation,
                               const BundleState& state) const {
    return state.cameras[first_camera_[observation.pose] + observation.camera];
  }
  /// Of observation i, which the point seen is that of.
  Eigen::Vector2d residual_of(std::size_t i,
                              const InverseRangePoint& seen,
                              const BundleState& state) const;
  /// The same of its range.
  double range_residual_of(std::size_t i,
                           const InverseRangePoint& seen,
                           const BundleState& state) const;
  bool has_depth(const BundleObservation& observation) const {
    const BundleCalibration* const calibration = problem_.calibration_of(observation.pose);
    return calibration && calibration->has_depths;
  }
  void allocate();
  /// Of sum(begin, end) over parts of [0, count), which may run in several threads.
  template <class Sum>
  double sum_over(std::size_t count, const Sum& sum) {
    std::vector<double> sums((count + kNumPointsAtOnce - 1) / kNumPointsAtOnce);
    threads_.for_chunks(count, kNumPointsAtOnce, [&](std::size_t begin, std::size_t end) {
      sums[begin / kNumPointsAtOnce] = sum(begin, end);
    });
    return std::accumulate(sums.begin(), sums.end(), 0.0);
  }
  double loss(std::size_t i, const BundleState& state) const;
  double motion_cost(const BundleState& state) const;
  double cost(const BundleState& state);
  void linearize();
  void linearize_one_by_one();
  void add_motion();
  void add_motion_column(std::uint32_t slot,
                         std::span<const std::uint32_t> places,
                         double* sums) const;
  static BundlePlaces places_of(const BundleState& state);
  template <int kRows>
  void accumulate(const ResidualRows<kRows>& rows,
                  std::size_t entry,
                  std::size_t k,
                  const Eigen::Vector3d& point_in_rig);
  template <int kRows>
  void set_by_calibration(const ResidualRows<kRows>& rows,
                          std::size_t i,
                          const Eigen::Vector3d& point_in_rig,
                          ByCalibration& by) const;
  template <int kRows>
  struct Jacobians {
    Eigen::Matrix<double, kRows, 3> by_point;
    Eigen::Matrix<double, kRows, 6> by_pose;
    ByCalibration by_calibration;  ///< By the parameters of its camera, where they are unknown.
  };
  template <int kRows>
  Jacobians<kRows> jacobians(const ResidualRows<kRows>& rows,
                             std::size_t i,
                             const Eigen::Vector3d& point_in_rig) const;
  template <class Visit>
  void visit_rows(std::size_t i, const Visit& visit) const;
  void add_told(std::size_t entry);
  /// Builds the reduced system of the damped equations; the links are eliminated ones after it.
  void reduce(double damping);
  void eliminate_point(std::size_t entry, double damping);
  void reduce_panel(std::size_t panel, double damping);
  void reduce_column(std::uint32_t slot, std::span<const std::uint32_t> places, double* sums);
  bool solve_reduced();
  double substitute_back(double damping);
  double move_point(std::size_t entry, double damping);

  const BundleProblem& problem_;
  const BundleOptions& options_;
  const SchurStructure plan_;
  std::vector<std::size_t> first_camera_;  // Of the rig of each pose, in BundleState::cameras.
  BundleArrays arrays_;                    // Of the observations, where there is no border_.
  std::vector<double> padded_poses_;
  BundleState state_;
  BundleState candidate_;
  NormalBlocks blocks_;
  std::vector<Eigen::Matrix3d> half_inverses_;   // M with M^T * M = inverse of the damped block.
  std::vector<Eigen::Vector3d> half_gradients_;  // M times the gradients of points.
  std::vector<std::uint32_t> entry_of_link_;
  std::vector<std::uint32_t> links_of_slot_;     // Ascending.
  std::vector<std::size_t> first_link_of_slot_;  // And one past the end.
  /// Of the lower triangle, below the diagonal.
  struct MotionBlock {
    std::uint32_t column, row;
    Matrix6d value;
  };
  std::vector<MotionBlock> motion_blocks_;   // By column.
  std::optional<CalibrationBorder> border_;  // Where the calibration is unknown.
  ThreadPool threads_;
  BlockCholesky reduced_;
  Eigen::VectorXd reduced_gradient_;
};

/// Derivatives of the rows of observation i by all that they depend on.
template <int kRows>
SchurSolver::Jacobians<kRows> SchurSolver::jacobians(const ResidualRows<kRows>& rows,
                                                     std::size_t i,
                                                     const Eigen::Vector3d& point_in_rig) const {
  const BundleObservation& observation = problem_.observations[i];
  Jacobians<kRows> jacobians;
  const Eigen::Matrix<double, kRows, 3> by_rig =
      rows.by_point_in_cam * camera_of(observation, state_).rotation;
  jacobians.by_point = by_rig * state_.matrices[observation.pose].rotation;
  jacobians.by_pose.template leftCols<3>() = by_rig;
  for (int row = 0; row < kRows; ++row) {
    const Eigen::Vector3d gradient = by_rig.row(row).transpose();
    jacobians.by_pose.template block<1, 3>(row, 3) = point_in_rig.cross(gradient).transpose();
  }
  if (problem_.calibration_of(observation.pose)) {
    set_by_calibration(rows, i, point_in_rig, jacobians.by_calibration);
  }
  return jacobians;
}

/// Calls visit(rows, point_in_rig) with what an observation gives, if anything.
template <class Visit>
void SchurSolver::visit_rows(std::size_t i, const Visit& visit) const {
  const BundleObservation& observation = problem_.observations[i];
  const Eigen::Vector3d point_in_rig =
      apply(state_.matrices[observation.pose], state_.points[observation.point]);
  const InverseRangePoint seen =
      in_inverse_range(apply(camera_of(observation, state_), point_in_rig));
  if (!is_ahead(seen, observation.bearing)) return;
  const Eigen::Vector2d residual = residual_of(i, seen, state_);
  const double root = std::sqrt(huber(residual.squaredNorm(), options_.huber_px).weight);
  const Matrix23d by_point = bearing_residual_by_point(seen, observation.level_pixel_from_bearing);
  if (!(observation.inverse_range_sigma > 0.0f)) {
    visit(ResidualRows<2>{root, 0.0, root * residual, root * by_point}, point_in_rig);
    return;
  }
  const double sigma = observation.inverse_range_sigma;
  const double range = range_residual_of(i, seen, state_);
  const double range_root = std::sqrt(huber(range * range, options_.range_huber).weight);
  ResidualRows<3> rows;
  rows.bearing_root = root;
  rows.range_scale = range_root / sigma;
  rows.residual << root * residual, range_root * range;
  rows.by_point_in_cam << root * by_point,
      range_root * (has_depth(observation) ? depth_residual_by_point(seen, sigma)
                                           : range_residual_by_point(seen, sigma));
  visit(rows, point_in_rig);
}

}  // namespace waymark

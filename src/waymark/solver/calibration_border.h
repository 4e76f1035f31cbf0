// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "waymark/solver/block_cholesky.h"
#include "waymark/solver/bundle_problem.h"

namespace waymark {

/// Derivative of the residual rows of an observation by the parameters of its camera, transposed: a
/// column per residual row. Parameters lie side by side wherever there are some, for SIMD.
using ByCalibration = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 43, 3>;

/// The unknown calibration in the normal equations of bundle adjustment: few rows and columns in
/// which every pose and point takes part, hence a dense border around the sparse reduced system
/// (Triggs et al. 2000, 6.1 and 6.3).
class CalibrationBorder {
 public:
  CalibrationBorder(std::size_t num_parameters, std::size_t num_slots, std::size_t num_points);

  /// Begins the equations with the prior alone.
  void begin(const BundleCalibration& calibration, const Eigen::VectorXd& change);

  /// Adds the rows of an observation, all times the root of their weight. first_parameter: of its
  /// camera.
  template <class Residual, class ByPoint>
  void add(std::size_t first_parameter,
           const ByCalibration& by_calibration,
           const Residual& residual,
           std::size_t point,
           const ByPoint& by_point) {
    const auto first = static_cast<Eigen::Index>(first_parameter);
    const Eigen::Index count = by_calibration.rows();
    // Of two or three rows: what makes large products fast makes these slow.
    information_.block(first, first, count, count) +=
        by_calibration.lazyProduct(by_calibration.transpose());
    gradient_.segment(first, count) += by_calibration.lazyProduct(residual);
    points_.block(first, 3 * static_cast<Eigen::Index>(point), count, 3) +=
        by_calibration.lazyProduct(by_point);
  }
  template <class ByPose>
  void add_pose(std::size_t first_parameter,
                const ByCalibration& by_calibration,
                std::size_t slot,
                const ByPose& by_pose) {
    poses_.block(static_cast<Eigen::Index>(first_parameter),
                 static_cast<Eigen::Index>(6 * slot),
                 by_calibration.rows(),
                 6) += by_calibration.lazyProduct(by_pose);
  }

  /// Copies the equations for elimination, damped.
  void begin_elimination(double damping);
  /// Eliminates a point, which until begin() is kept times M. half: M with M^T * M the inverse of
  /// its damped block; gradient: M * that of the point.
  void eliminate_point(std::size_t point,
                       const Eigen::Matrix3d& half,
                       const Eigen::Vector3d& gradient);
  /// The same for what a point that was eliminated has to do with a pose: link * M^T. Slots may be
  /// worked on by several threads.
  void eliminate_link(std::size_t slot,
                      std::size_t point,
                      const Eigen::Matrix<double, 6, 3>& eliminated);

  /// Solves the whole: gradient, of the poses, becomes their solution. False if the equations have
  /// none.
  bool solve(const BlockCholesky& poses, Eigen::VectorXd& gradient);

  const Eigen::VectorXd& solution() const { return solution_; }
  const Eigen::VectorXd& gradient() const { return gradient_; }
  auto diagonal() const { return information_.diagonal(); }
  /// What the solution takes from the gradient of a point that was eliminated, times M.
  Eigen::Vector3d share_of_point(std::size_t point) const;

  /// What a point has to do with the calibration, a row per parameter: second derivative of the
  /// cost, times M between eliminate_point() and begin().
  auto of_point(std::size_t point) const {
    return points_.middleCols<3>(3 * static_cast<Eigen::Index>(point));
  }
  // After solve():
  /// How a pose follows the calibration, negated.
  auto solved(std::size_t slot) const {
    return solved_.middleCols<6>(static_cast<Eigen::Index>(6 * slot));
  }
  /// Adds what an observation at a pose of so many, in the order of time, tells, all else
  /// following: the derivatives of its rows, a row per parameter, and its residual.
  template <class Residual>
  void add_told(std::size_t pose,
                std::size_t num_poses,
                const Eigen::MatrixXd& by_calibration,
                const Residual& residual) {
    CalibrationTold& part = parts_[pose * kNumParts / num_poses];
    part.information.selfadjointView<Eigen::Lower>().rankUpdate(by_calibration);
    part.gradient += by_calibration.lazyProduct(residual);
  }
  CalibrationEvidence evidence() const;

 private:
  /// The way is divided into so many parts: enough to compare them, and long enough each for errors
  /// that last to stay within one.
  static constexpr std::size_t kNumParts = 10;

  Eigen::MatrixXd information_;
  Eigen::VectorXd gradient_;
  Eigen::MatrixXd poses_;   // 6 columns per slot.
  Eigen::MatrixXd points_;  // 3 columns per point.
  // The same, on the way of elimination.
  Eigen::MatrixXd reduced_information_;
  Eigen::VectorXd reduced_gradient_;
  Eigen::MatrixXd reduced_poses_;
  Eigen::VectorXd solution_;
  Eigen::MatrixXd solved_;  // The reduced poses, times the inverse of their own equations.
  std::vector<CalibrationTold> parts_;
};

}  // namespace waymark

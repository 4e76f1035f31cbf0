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

/// Columns of derivatives with their residuals, kept until there are enough of them for a product
/// that is worth its while: one of the two or three of an observation is slow in every form.
class CalibrationColumns {
 public:
  explicit CalibrationColumns(Eigen::Index num_parameters)
      : columns_(num_parameters, kCapacity), residuals_(kCapacity) {}

  bool is_full() const { return used_ + kMostColumns > kCapacity; }
  template <class Columns, class Residual>
  void add(const Columns& columns, const Residual& residual) {
    columns_.middleCols(used_, residual.size()) = columns;
    residuals_.segment(used_, residual.size()) = residual;
    used_ += residual.size();
  }
  Eigen::Index num_parameters() const { return columns_.rows(); }
  /// Adds their products to the lower half of the second derivative and to the gradient, and
  /// forgets them.
  void flush(Eigen::Ref<Eigen::MatrixXd> information, Eigen::Ref<Eigen::VectorXd> gradient);
  void clear() { used_ = 0; }

 private:
  static constexpr Eigen::Index kMostColumns = 3;  // Of an observation.
  static constexpr Eigen::Index kCapacity = 96;

  Eigen::MatrixXd columns_;
  Eigen::VectorXd residuals_;
  Eigen::Index used_ = 0;
};

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
    CameraColumns& camera = columns_of(first, count);
    camera.columns.add(by_calibration, residual);
    if (camera.columns.is_full()) flush(camera);
    // Of two or three rows: what makes large products fast makes this slow.
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

  /// Copies the equations for elimination, damped. Nothing is to be added after it.
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
  template <class ByParameters, class Residual>
  void add_told(std::size_t pose,
                std::size_t num_poses,
                const ByParameters& by_parameters,
                const Residual& residual) {
    PartOfWay& part = parts_[pose * kNumParts / num_poses];
    part.columns.add(by_parameters, residual);
    if (part.columns.is_full()) part.columns.flush(part.told.information, part.told.gradient);
  }
  CalibrationEvidence evidence();

 private:
  /// The way is divided into so many parts: enough to compare them, and long enough each for errors
  /// that last to stay within one.
  static constexpr std::size_t kNumParts = 10;

  /// Of the observations of a camera.
  struct CameraColumns {
    Eigen::Index first;  // Of its parameters.
    CalibrationColumns columns;
  };
  struct PartOfWay {
    CalibrationTold told;  // The lower half of the information.
    CalibrationColumns columns;
  };

  CameraColumns& columns_of(Eigen::Index first, Eigen::Index count) {
    for (CameraColumns& camera : cameras_) {
      if (camera.first == first && camera.columns.num_parameters() == count) return camera;
    }
    cameras_.push_back({first, CalibrationColumns(count)});
    return cameras_.back();
  }
  void flush(CameraColumns& camera);

  std::vector<CameraColumns> cameras_;
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
  std::vector<PartOfWay> parts_;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "waymark/camera/calibration.h"
#include "waymark/camera/camera.h"
#include "waymark/camera/rig.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/solver/bundle_motion.h"

namespace waymark {

/// One feature that sees one point.
struct BundleObservation : Measurement {
  std::uint32_t pose = 0;   ///< Index in BundleProblem::rig_from_world.
  std::uint32_t point = 0;  ///< Index in BundleProblem::points.
};

/// What the residuals of a bundle adjustment tell of a calibration where it ended, all else free to
/// follow: second and first derivative of the cost, as if each residual were an independent
/// pixel's.
struct CalibrationTold {
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
};

/// The same, and what each part of the way has to do with it: errors that last make parts
/// contradict each other by more than the noise of their residuals explains.
struct CalibrationEvidence {
  CalibrationTold whole;               ///< Empty where the equations have no solution.
  std::vector<CalibrationTold> parts;  ///< In the order of time, of about as many poses each.

  bool is_empty() const { return whole.gradient.size() == 0; }
  /// Covariance of the gradient after a step, as the parts show it that differ in what they pull
  /// to: the "meat" of a sandwich estimate with time as clusters (White 1980; Liang and Zeger
  /// 1986). Equal to the information where residuals are independent with 1 px.
  Eigen::MatrixXd scatter_after(const Eigen::VectorXd& step) const;
};

/// The calibration of one rig as unknowns of the adjustment, by how much it differs from what the
/// observations were measured with. Intrinsics act linearly, by derivatives that the caller takes:
/// measure anew after large changes.
struct BundleCalibration {
  const Rig* rig = nullptr;                          ///< Poses of other rigs know nothing of it.
  std::vector<CalibrationParameters::Block> blocks;  ///< Per camera of the rig.
  /// Per observation of `rig`, where the derivatives of its level's pixel by the intrinsics of its
  /// camera begin: 2 x num_intrinsics, column by column.
  std::vector<std::size_t> first_derivative;
  std::vector<float> level_pixel_by_intrinsics;
  /// Of rigs of one camera with a depth image, whose measured inverse range changes as well: its
  /// derivatives, num_intrinsics per observation in their order, 1/m per unit. Empty: none changes.
  std::vector<float> inverse_range_by_intrinsics;
  /// The prior: half of (change - prior_change)^T prior_information (change - prior_change), in the
  /// units of the cost of residuals.
  Eigen::MatrixXd prior_information;
  Eigen::VectorXd prior_change;
  Eigen::VectorXd change;        ///< Where to begin, and the result.
  bool has_depths = false;       ///< The inverse ranges of `rig` are those of depths, along z.
  CalibrationEvidence evidence;  ///< The result.

  /// Derivative of the pixel of an observation's level by the intrinsics of its camera.
  Eigen::Map<const Eigen::Matrix2Xf> by_intrinsics(std::size_t observation,
                                                   std::uint8_t camera) const;
  /// What a change of the intrinsics moves that pixel by.
  Eigen::Vector2d pixel_shift(std::size_t observation,
                              std::uint8_t camera,
                              const Eigen::VectorXd& change) const;
  /// Derivative of what the depth image measures; zero where none changes.
  Eigen::Map<const Eigen::RowVectorXf> inverse_range_by(std::size_t observation) const;
  /// What a change moves the inverse range by that is measured of an observation, in 1/m.
  double inverse_range_shift(std::size_t observation, const Eigen::VectorXd& change) const;
  /// cam_from_rig with a change of its turns.
  Rigid3 cam_from_rig(std::size_t camera, const Eigen::VectorXd& change) const;
};

/// Poses and points in contiguous arrays, in the order of their ids, and what ties them.
struct BundleProblem {
  std::vector<Rigid3> rig_from_world;
  std::vector<const Rig*> rigs;                 ///< Per pose; sessions may differ in cameras.
  std::vector<std::uint8_t> is_pose_fixed;      ///< Per pose.
  std::vector<Eigen::Vector3d> points;          ///< In the world.
  std::vector<BundleObservation> observations;  ///< Sorted by point.
  std::optional<BundleCalibration> calibration = std::nullopt;  ///< Where it is unknown.
  std::optional<BundleMotion> motion = std::nullopt;  ///< Not together with a calibration.

  /// The same for a pose of the rig whose calibration is unknown, else null.
  const BundleCalibration* calibration_of(std::uint32_t pose) const {
    return calibration && calibration->rig == rigs[pose] ? &*calibration : nullptr;
  }
};

struct BundleOptions {
  /// Each round minimises with Huber's loss over the observations that passed the gate after the
  /// round before (the first: over all), then every observation meets the gate again.
  int num_rounds = 2;
  int max_iterations_per_round = 10;
  /// Residual length where the loss turns linear, at most: each round takes twice the noise that
  /// its residuals show, if that is less.
  double huber_px = 2.0;
  double range_huber = 1.0;  ///< The same for residuals of ranges, in sigmas.
  double gate_px = 2.45;     ///< Longest residual of an inlier: 95 % of those with 1 px of noise.
  /// A round ends early when an iteration lowers the cost by less than this part of it.
  double relative_cost_tolerance = 1e-5;
  double initial_damping = 1e-4;  ///< Of each round, by the diagonal of the equations.
  bool with_evidence = true;      ///< Of the calibration, where that is unknown; of the last round.
  unsigned num_threads = 1;       ///< That share the work. The result is the same to the bit.
};

}  // namespace waymark

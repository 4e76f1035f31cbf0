// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/pose.h"

#include <algorithm>
#include <cmath>

#include "waymark/base/median.h"
#include "waymark/geometry/robust_loss.h"
#include "waymark/solver/levenberg_marquardt.h"
#include "waymark/solver/pose_kernel.h"
#include "waymark/solver/residual.h"

namespace waymark {

namespace {

using Arrays = PoseWorkspace::Arrays;

/// Fewer do not determine a pose.
constexpr std::size_t kMinObservations = 3;
/// A component of a residual is assumed to have a standard deviation of 1 px, see pose.h. An inlier
/// has a squared residual below the 95 % quantile of chi-square with 2 degrees of freedom.
constexpr double kGate = 5.991;
/// Scales of the losses in units of the noise: of the last Geman-McClure stage, and of Huber's
/// loss, which leaves most inliers untouched.
constexpr double kFinalScale = 2.5;
constexpr double kHuberScale = 1.8;
/// The scale shrinks by this factor from stage to stage.
constexpr double kAnnealing = 0.5;
constexpr int kIterationsPerStage = 2;
constexpr int kIterationsPerRound = 6;
constexpr int kNumRounds = 2;
/// Iterations end when the next step would lower the cost by less than this, in units of the
/// squared noise. Its root is the step in units of the pose's own standard deviation.
constexpr double kCoarseDecrease = 1e-2;
constexpr double kFineDecrease = 1e-4;
/// Residual components that the assumed noise counts as when the noise is measured.
constexpr double kNoisePriorStrength = 8.0;

NormalEquations<6> unpack(const PoseSums& sums) {
  NormalEquations<6> equations;
  std::size_t k = 0;
  for (int a = 0; a < 6; ++a) {
    for (int b = a; b < 6; ++b) {
      equations.hessian(a, b) = equations.hessian(b, a) = sums[k++];
    }
    equations.gradient[a] = sums[21 + static_cast<std::size_t>(a)];
  }
  equations.cost = sums[27];
  return equations;
}

/// The state of one call.
class PoseSolver {
 public:
  PoseSolver(const Rig& rig, const Rigid3& initial, Arrays& arrays)
      : rig_(rig), rig_from_world_(initial), arrays_(arrays) {}

  const Rigid3& rig_from_world() const { return rig_from_world_; }
  int num_iterations() const { return num_iterations_; }

  NormalEquations<6> linearize(const Rigid3& rig_from_world, const PoseRobust& robust) const {
    NormalEquations<6> total;
    for (const PoseSegment& segment : arrays_.segments) {
      const Rigid3& cam_from_rig = rig_.cameras[segment.camera].cam_from_rig;
      const NormalEquations<6> part =
          unpack(sum_normal_equations(arrays_, segment, cam_from_rig * rig_from_world, robust));
      const Matrix6d adjoint = cam_from_rig.adjoint();
      total.hessian.noalias() += adjoint.transpose() * part.hessian * adjoint;
      total.gradient.noalias() += adjoint.transpose() * part.gradient;
      total.cost += part.cost;
    }
    return total;
  }

  /// Returns the equations at the pose reached.
  NormalEquations<6> minimize(const PoseRobust& robust, int max_iterations, double negligible) {
    const auto at = [&](const Rigid3& pose) { return linearize(pose, robust); };
    return minimize_over_pose(rig_from_world_, at, max_iterations, negligible, num_iterations_);
  }

  /// The part of the Hessian at the pose reached that the bearings contribute.
  Matrix6d bearing_hessian(const PoseRobust& robust) {
    for (PoseSegment& segment : arrays_.segments) segment.has_ranges = false;
    return linearize(rig_from_world_, robust).hessian;
  }

  bool has_ranges() const {
    return std::any_of(arrays_.segments.begin(), arrays_.segments.end(), [](const auto& segment) {
      return segment.has_ranges;
    });
  }

  /// Variance of the residuals of ranges: that which makes the inverse of their part of the Hessian
  /// the covariance that they show, weighed as they are (White 1980). The assumed one counts as
  /// kNoisePriorStrength ranges.
  double measure_range_variance(const PoseRobust& robust) const {
    double sum_of_weights = kNoisePriorStrength;
    double sum = kNoisePriorStrength;
    const auto& fields = arrays_.fields;
    for (const PoseSegment& segment : arrays_.segments) {
      const Rigid3 cam_from_world = rig_.cameras[segment.camera].cam_from_rig * rig_from_world_;
      for (std::size_t i = segment.begin; i < segment.end; ++i) {
        const double scale = fields[kInverseRangeScale][i];
        if (!(scale * fields[kWeight][i] > 0.0)) continue;
        const Eigen::Vector3d point(fields[kPointX][i], fields[kPointY][i], fields[kPointZ][i]);
        const InverseRangePoint seen = in_inverse_range(cam_from_world * point);
        const double squared =
            std::pow(range_residual(seen, fields[kInverseRange][i], 1.0 / scale), 2);
        const double weight = fields[kWeight][i] * geman_mcclure(squared, robust.scale_px).weight;
        sum_of_weights += weight;
        sum += weight * weight * squared;
      }
    }
    return sum / sum_of_weights;
  }

  void compute_residuals() {
    for (const PoseSegment& segment : arrays_.segments) {
      const Rigid3& cam_from_rig = rig_.cameras[segment.camera].cam_from_rig;
      compute_squared_residuals(arrays_, segment, cam_from_rig * rig_from_world_);
    }
  }

  /// Runs through Geman-McClure losses from the width of the residuals at hand to that of the
  /// noise.
  void anneal() {
    compute_residuals();
    double scale = std::max(kFinalScale, median_residual());
    while (scale > kFinalScale) {
      minimize({PoseLoss::kGemanMcClure, scale}, kIterationsPerStage, kCoarseDecrease);
      scale *= kAnnealing;
    }
    minimize({PoseLoss::kGemanMcClure, kFinalScale}, kIterationsPerRound, kCoarseDecrease);
  }

 private:
  double median_residual() {
    auto& values = arrays_.scratch;
    values.clear();
    for (std::size_t i = 0; i < arrays_.observation.size(); ++i) {
      if (arrays_.observation[i] != UINT32_MAX) values.push_back(arrays_.squared_residual[i]);
    }
    return std::sqrt(median(values));
  }

  const Rig& rig_;
  Rigid3 rig_from_world_;
  Arrays& arrays_;
  int num_iterations_ = 0;
};

/// Variance of a residual component. The gate cuts off the tail of the residuals: for a squared
/// length s = variance * chi2(2) below the gate, E[s] = 2 * variance - gate * q / (1 - q), q =
/// exp(-gate / (2 * variance)); solved by fixed-point iteration. The assumed noise counts as
/// kNoisePriorStrength components.
double measure_variance(const Arrays& arrays) {
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < arrays.observation.size(); ++i) {
    if (arrays.observation[i] == UINT32_MAX || !arrays.is_inlier[arrays.observation[i]]) continue;
    sum += arrays.squared_residual[i];
    count += 1.0;
  }
  // The pose absorbs 6 components, as many as the observations have at most.
  const double num_components = std::max(0.0, 2.0 * count - 6.0) + kNoisePriorStrength;
  double variance = (kNoisePriorStrength + sum) / num_components;
  for (int iteration = 0; iteration < 5; ++iteration) {
    const double q = std::exp(-kGate / (2.0 * std::min(variance, 1.0)));
    variance = (kNoisePriorStrength + sum + count * kGate * q / (1.0 - q)) / num_components;
  }
  return variance;
}

}  // namespace

PoseEstimate optimize_pose(const Rig& rig,
                           const PoseObservations& observations,
                           const Rigid3& initial_rig_from_world,
                           PoseWorkspace& workspace) {
  Arrays& arrays = workspace.arrays();
  const PoseRobust huber = {PoseLoss::kHuber, kHuberScale};
  const std::size_t num_usable = gather_pose_observations(rig, observations, arrays);
  PoseSolver solver(rig, initial_rig_from_world, arrays);
  const bool is_determined = num_usable >= kMinObservations;
  if (is_determined) solver.anneal();

  Matrix6d hessian = Matrix6d::Zero();
  solver.compute_residuals();
  PoseClasses classes = classify_pose_observations(kGate, arrays);
  for (int round = 0; round < kNumRounds && is_determined; ++round) {
    if (round > 0 && classes.num_changed == 0) break;
    hessian = solver.minimize(huber, kIterationsPerRound, kFineDecrease).hessian;
    solver.compute_residuals();
    classes = classify_pose_observations(kGate, arrays);
  }
  const double variance = measure_variance(arrays);
  const double range_variance = solver.measure_range_variance(huber);
  const Matrix6d of_bearings = solver.has_ranges() ? solver.bearing_hessian(huber) : hessian;
  const Matrix6d information = of_bearings / variance + (hessian - of_bearings) / range_variance;
  PoseEstimate estimate;
  estimate.rig_from_world = solver.rig_from_world();
  estimate.is_inlier = arrays.is_inlier;
  estimate.num_inliers = classes.num_inliers;
  estimate.covariance = covariance_from<6>(information);
  estimate.num_iterations = solver.num_iterations();
  return estimate;
}

}  // namespace waymark

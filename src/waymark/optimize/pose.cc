// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/pose.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "waymark/base/median.h"
#include "waymark/optimize/pose_arrays.h"
#include "waymark/optimize/pose_kernel.h"

namespace waymark {

namespace {

using Arrays = PoseWorkspace::Arrays;

/// Fewer do not determine a pose.
constexpr std::size_t kMinObservations = 3;
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
/// Prior information in 1/m^2 and 1/rad^2 that keeps the covariance finite.
constexpr double kPriorInformation = 1e-6;
/// Residual components that the assumed noise counts as when the noise is measured.
constexpr double kNoisePriorStrength = 8.0;

struct NormalEquations {
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double cost = 0.0;
};

NormalEquations unpack(const PoseSums& sums) {
  NormalEquations equations;
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
  PoseSolver(const Rig& rig, const Rigid3& initial, double noise_px, Arrays& arrays)
      : rig_(rig), rig_from_world_(initial), noise_px_(noise_px), arrays_(arrays) {}

  const Rigid3& rig_from_world() const { return rig_from_world_; }
  int num_iterations() const { return num_iterations_; }

  NormalEquations linearize(const Rigid3& rig_from_world, const PoseRobust& robust) const {
    NormalEquations total;
    for (const PoseSegment& segment : arrays_.segments) {
      const Rigid3& cam_from_rig = rig_.cameras[segment.camera].cam_from_rig;
      const NormalEquations part =
          unpack(sum_normal_equations(arrays_, segment, cam_from_rig * rig_from_world, robust));
      const Matrix6d adjoint = cam_from_rig.adjoint();
      total.hessian.noalias() += adjoint.transpose() * part.hessian * adjoint;
      total.gradient.noalias() += adjoint.transpose() * part.gradient;
      total.cost += part.cost;
    }
    return total;
  }

  /// Levenberg-Marquardt with the damping of Madsen, Nielsen & Tingleff 2004, 3.2; returns the
  /// equations at the pose reached.
  NormalEquations minimize(const PoseRobust& robust, int max_iterations, double negligible) {
    NormalEquations equations = linearize(rig_from_world_, robust);
    double damping = 1e-6;
    double growth = 2.0;
    for (int iteration = 0; iteration < max_iterations; ++iteration) {
      const Vector6d scale = equations.hessian.diagonal().array() + kPriorInformation;
      Matrix6d damped = equations.hessian;
      damped.diagonal() += damping * scale;
      damped.diagonal().array() += kPriorInformation;
      const Vector6d step = -damped.ldlt().solve(equations.gradient);
      const double decrease = step.dot(damping * scale.cwiseProduct(step) - equations.gradient);
      if (!(decrease > negligible * noise_px_ * noise_px_)) break;
      ++num_iterations_;
      const Rigid3 candidate = Rigid3::exp(step) * rig_from_world_;
      const NormalEquations next = linearize(candidate, robust);
      const double gain = (equations.cost - next.cost) / decrease;
      if (gain > 0.0) {
        rig_from_world_ = candidate;
        equations = next;
        damping *= std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * gain - 1.0, 3));
        growth = 2.0;
      } else {
        damping *= growth;
        growth *= 2.0;
      }
    }
    return equations;
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
    const double final_scale = kFinalScale * noise_px_;
    double scale = std::max(final_scale, median_residual());
    while (scale > final_scale) {
      minimize({PoseLoss::kGemanMcClure, scale}, kIterationsPerStage, kCoarseDecrease);
      scale *= kAnnealing;
    }
    minimize({PoseLoss::kGemanMcClure, final_scale}, kIterationsPerRound, kCoarseDecrease);
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
  double noise_px_;
  Arrays& arrays_;
  int num_iterations_ = 0;
};

struct Spread {
  double variance = 0.0;  ///< Of a residual component.
  double mean = 0.0;      ///< Of the residuals' length.
};

/// The gate cuts off the tail of the residuals: for a squared length s = variance * chi2(2) below
/// the gate, E[s] = 2 * variance - gate * q / (1 - q), q = exp(-gate / (2 * variance)); solved by
/// fixed-point iteration. The assumed noise counts as kNoisePriorStrength components.
Spread measure_spread(const Arrays& arrays, double gate, double assumed_variance) {
  double sum = 0.0;
  double sum_of_lengths = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < arrays.observation.size(); ++i) {
    if (arrays.observation[i] == UINT32_MAX || !arrays.is_inlier[arrays.observation[i]]) continue;
    sum += arrays.squared_residual[i];
    sum_of_lengths += std::sqrt(arrays.squared_residual[i]);
    count += 1.0;
  }
  // The pose absorbs 6 components, as many as the observations have at most.
  const double num_components = std::max(0.0, 2.0 * count - 6.0) + kNoisePriorStrength;
  const double prior = kNoisePriorStrength * assumed_variance;
  double variance = (prior + sum) / num_components;
  for (int iteration = 0; iteration < 5; ++iteration) {
    const double q = std::exp(-gate / (2.0 * std::min(variance, assumed_variance)));
    variance = (prior + sum + count * gate * q / (1.0 - q)) / num_components;
  }
  return {variance, count > 0.0 ? sum_of_lengths / count : 0.0};
}

/// Inverse of the information; a weak prior keeps it finite where there is none.
Matrix6d covariance_from(Matrix6d information) {
  const double floor = 1e-12 * information.diagonal().maxCoeff();
  information.diagonal().array() += std::max(kPriorInformation, floor);
  const Matrix6d inverse = information.ldlt().solve(Matrix6d::Identity());
  return 0.5 * (inverse + inverse.transpose());
}

}  // namespace

PoseEstimate optimize_pose(const Rig& rig,
                           const PoseObservations& observations,
                           const Rigid3& initial_rig_from_world,
                           const PoseOptions& options,
                           PoseWorkspace& workspace) {
  Arrays& arrays = workspace.arrays();
  const double gate = options.gate_chi2 * options.noise_px * options.noise_px;
  const PoseRobust huber = {PoseLoss::kHuber, kHuberScale * options.noise_px};
  const std::size_t num_usable =
      gather_pose_observations(rig, observations, options.noise_px, arrays);
  PoseSolver solver(rig, initial_rig_from_world, options.noise_px, arrays);
  const bool is_determined = num_usable >= kMinObservations;
  if (is_determined) solver.anneal();

  Matrix6d hessian = Matrix6d::Zero();
  solver.compute_residuals();
  PoseClasses classes = classify_pose_observations(observations, gate, arrays);
  for (int round = 0; round < kNumRounds && is_determined; ++round) {
    if (round > 0 && classes.num_changed == 0) break;
    hessian = solver.minimize(huber, kIterationsPerRound, kFineDecrease).hessian;
    solver.compute_residuals();
    classes = classify_pose_observations(observations, gate, arrays);
  }
  const double assumed_variance = options.noise_px * options.noise_px;
  const Spread spread = measure_spread(arrays, gate, assumed_variance);
  const Matrix6d of_bearings = solver.has_ranges() ? solver.bearing_hessian(huber) : hessian;
  const Matrix6d information =
      of_bearings / spread.variance + (hessian - of_bearings) / assumed_variance;
  PoseEstimate estimate;
  estimate.rig_from_world = solver.rig_from_world();
  estimate.is_inlier = arrays.is_inlier;
  estimate.num_inliers = classes.num_inliers;
  estimate.covariance = covariance_from(information);
  estimate.noise_measured_px = std::sqrt(spread.variance);
  estimate.mean_residual_px = spread.mean;
  estimate.num_iterations = solver.num_iterations();
  return estimate;
}

}  // namespace waymark

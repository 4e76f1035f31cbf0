// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/pose.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "waymark/base/check.h"
#include "waymark/optimize/pose_kernel.h"
#include "waymark/optimize/residual.h"

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
/// squared noise: a thousandth of the pose's own standard deviation.
constexpr double kNegligibleDecrease = 1e-6;
/// Prior information in 1/m^2 and 1/rad^2 that keeps the covariance finite.
constexpr double kPriorInformation = 1e-6;
/// Residual components that the assumed noise counts as when the noise is measured.
constexpr double kNoisePriorStrength = 8.0;

bool is_usable(const Rig& rig, const PoseObservations& observations, std::size_t i) {
  return observations.camera[i] < rig.cameras.size() &&
         observations.point_in_world[i].allFinite() && observations.bearing[i].allFinite() &&
         observations.level_pixel_from_bearing[i].allFinite();
}

void check_sizes(const PoseObservations& observations) {
  const std::size_t size = observations.size();
  const auto is_optional = [size](std::size_t other) { return other == 0 || other == size; };
  WAYMARK_CHECK(observations.bearing.size() == size);
  WAYMARK_CHECK(observations.level_pixel_from_bearing.size() == size);
  WAYMARK_CHECK(observations.camera.size() == size);
  WAYMARK_CHECK(is_optional(observations.inverse_range.size()));
  WAYMARK_CHECK(observations.inverse_range_sigma.size() == observations.inverse_range.size());
  WAYMARK_CHECK(is_optional(observations.weight.size()));
}

double weight_of(const PoseObservations& observations, std::size_t i) {
  if (observations.weight.empty()) return 1.0;
  const double weight = observations.weight[i];
  return weight > 0.0 && std::isfinite(weight) ? weight : 0.0;
}

void append(const PoseObservations& observations, std::size_t i, double noise_px, Arrays& arrays) {
  auto& fields = arrays.fields;
  const auto& point = observations.point_in_world[i];
  const auto& bearing = observations.bearing[i];
  const auto& w = observations.level_pixel_from_bearing[i];
  for (int axis = 0; axis < 3; ++axis) {
    fields[kPointX + axis].push_back(point[axis]);
    fields[kBearingX + axis].push_back(bearing[axis]);
    fields[kW00 + axis].push_back(w(0, axis));
    fields[kW10 + axis].push_back(w(1, axis));
  }
  double inverse_range = 0.0;
  double scale = 0.0;
  if (!observations.inverse_range.empty() && observations.inverse_range_sigma[i] > 0.0f &&
      std::isfinite(observations.inverse_range[i])) {
    inverse_range = observations.inverse_range[i];
    scale = noise_px / observations.inverse_range_sigma[i];
  }
  fields[kInverseRange].push_back(inverse_range);
  fields[kInverseRangeScale].push_back(scale);
  fields[kWeight].push_back(weight_of(observations, i));
  arrays.observation.push_back(static_cast<std::uint32_t>(i));
}

void pad(Arrays& arrays) {
  while (arrays.observation.size() % kPoseLanes != 0) {
    for (auto& field : arrays.fields) field.push_back(0.0);
    arrays.observation.push_back(UINT32_MAX);
  }
}

/// Returns the number of observations that can be used.
std::size_t gather(const Rig& rig,
                   const PoseObservations& observations,
                   double noise_px,
                   Arrays& arrays) {
  for (auto& field : arrays.fields) field.clear();
  arrays.observation.clear();
  arrays.segments.clear();
  arrays.is_inlier.assign(observations.size(), 0);
  std::size_t num_usable = 0;
  for (std::size_t camera = 0; camera < rig.cameras.size(); ++camera) {
    const std::size_t begin = arrays.observation.size();
    for (std::size_t i = 0; i < observations.size(); ++i) {
      if (observations.camera[i] != camera || !is_usable(rig, observations, i)) continue;
      append(observations, i, noise_px, arrays);
      ++num_usable;
    }
    pad(arrays);
    if (arrays.observation.size() > begin) {
      arrays.segments.push_back({camera, begin, arrays.observation.size()});
    }
  }
  arrays.squared_residual.assign(arrays.observation.size(), 0.0);
  return num_usable;
}

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
  NormalEquations minimize(const PoseRobust& robust, int max_iterations) {
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
      if (!(decrease > kNegligibleDecrease * noise_px_ * noise_px_)) break;
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
      minimize({PoseLoss::kGemanMcClure, scale}, kIterationsPerStage);
      scale *= kAnnealing;
    }
    minimize({PoseLoss::kGemanMcClure, final_scale}, kIterationsPerRound);
  }

 private:
  double median_residual() {
    auto& values = arrays_.scratch;
    values.clear();
    for (std::size_t i = 0; i < arrays_.observation.size(); ++i) {
      if (arrays_.observation[i] != UINT32_MAX) values.push_back(arrays_.squared_residual[i]);
    }
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return std::sqrt(*middle);
  }

  const Rig& rig_;
  Rigid3 rig_from_world_;
  double noise_px_;
  Arrays& arrays_;
  int num_iterations_ = 0;
};

/// Sets is_inlier by the gate and gives outliers the weight 0; returns the number of inliers.
std::size_t classify(const PoseObservations& observations, double gate, Arrays& arrays) {
  std::size_t num_inliers = 0;
  for (std::size_t i = 0; i < arrays.observation.size(); ++i) {
    const std::uint32_t observation = arrays.observation[i];
    if (observation == UINT32_MAX) continue;
    const bool is_inlier = arrays.squared_residual[i] < gate;
    arrays.is_inlier[observation] = is_inlier;
    arrays.fields[kWeight][i] = is_inlier ? weight_of(observations, observation) : 0.0;
    num_inliers += is_inlier;
  }
  return num_inliers;
}

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

Matrix6d invert(Matrix6d information) {
  const double floor = 1e-12 * information.diagonal().maxCoeff();
  information.diagonal().array() += std::max(kPriorInformation, floor);
  const Matrix6d inverse = information.ldlt().solve(Matrix6d::Identity());
  return 0.5 * (inverse + inverse.transpose());
}

}  // namespace

void PoseObservations::clear() {
  point_in_world.clear();
  bearing.clear();
  level_pixel_from_bearing.clear();
  camera.clear();
  inverse_range.clear();
  inverse_range_sigma.clear();
  weight.clear();
}

PoseWorkspace::PoseWorkspace() : arrays_(std::make_unique<Arrays>()) {}
PoseWorkspace::~PoseWorkspace() = default;
PoseWorkspace::PoseWorkspace(PoseWorkspace&&) noexcept = default;
PoseWorkspace& PoseWorkspace::operator=(PoseWorkspace&&) noexcept = default;

PoseEstimate optimize_pose(const Rig& rig,
                           const PoseObservations& observations,
                           const Rigid3& initial_rig_from_world,
                           const PoseOptions& options,
                           PoseWorkspace& workspace) {
  check_sizes(observations);
  Arrays& arrays = workspace.arrays();
  const double gate = options.gate_chi2 * options.noise_px * options.noise_px;
  const PoseRobust huber = {PoseLoss::kHuber, kHuberScale * options.noise_px};
  const std::size_t num_usable = gather(rig, observations, options.noise_px, arrays);
  PoseSolver solver(rig, initial_rig_from_world, options.noise_px, arrays);
  const bool is_determined = num_usable >= kMinObservations;
  if (is_determined) solver.anneal();

  PoseEstimate estimate;
  NormalEquations equations;
  solver.compute_residuals();
  estimate.num_inliers = classify(observations, gate, arrays);
  for (int round = 0; round < kNumRounds && is_determined; ++round) {
    equations = solver.minimize(huber, kIterationsPerRound);
    solver.compute_residuals();
    estimate.num_inliers = classify(observations, gate, arrays);
  }
  const Spread spread = measure_spread(arrays, gate, options.noise_px * options.noise_px);
  estimate.rig_from_world = solver.rig_from_world();
  estimate.is_inlier = arrays.is_inlier;
  estimate.covariance = spread.variance * invert(equations.hessian);
  estimate.noise_measured_px = std::sqrt(spread.variance);
  estimate.mean_residual_px = spread.mean;
  estimate.num_iterations = solver.num_iterations();
  return estimate;
}

}  // namespace waymark

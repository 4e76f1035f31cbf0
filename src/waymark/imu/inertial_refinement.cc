// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/geometry/robust_loss.h"
#include "waymark/imu/chain_hessian.h"
#include "waymark/imu/start_steps.h"
#include "waymark/solver/levenberg_marquardt.h"

namespace waymark {
namespace {

constexpr int kMaxRefinements = 30;
/// Of the squared error, which is in standard deviations.
constexpr double kNegligibleError = 1e-2;

/// What a velocity is below in m/s, where nothing tells it.
constexpr double kAnySpeed = 1000.0;
/// Poses that are not seen may be so many times as far from the guess as others from what is seen.
constexpr double kUnseen = 1e5;

/// A step of all unknowns: setup, then the states. Velocities grow with the scale, and their own
/// part is added to that: otherwise all would have to follow each step of the scale to within the
/// errors of vision, along a bent valley in which only tiny steps lower the cost.
struct UnknownsStep {
  Eigen::VectorXd tangent;
};

/// As minimize_over_pose wants them.
struct SteppedUnknowns : InertialUnknowns {
  static UnknownsStep exp(const Eigen::VectorXd& tangent) { return {tangent}; }
};

SteppedUnknowns operator*(const UnknownsStep& step, SteppedUnknowns unknowns) {
  unknowns.setup = unknowns.setup.moved(step.tangent.head<10>());
  const double growth = std::exp(step.tangent[2]);
  Eigen::Index at = 10;
  for (InertialState& state : unknowns.states) {
    state.velocity *= growth;
    state = state.moved(step.tangent.segment<15>(at));
    at += 15;
  }
  return unknowns;
}

/// NormalEquations of a size that is known only when it runs.
struct UnknownsEquations {
  ChainHessian hessian;
  Eigen::VectorXd gradient;
  double cost = 0.0;

  explicit UnknownsEquations(std::size_t num_states)
      : hessian(num_states), gradient(Eigen::VectorXd::Zero(hessian.diagonal().size())) {}
  /// Components from there on that are off by so much, with one standard deviation.
  void add_prior(Eigen::Index at, const Eigen::VectorXd& error, double sigma) {
    const double information = 1.0 / (sigma * sigma);
    hessian.diagonal().segment(at, error.size()).array() += information;
    gradient.segment(at, error.size()) += information * error;
    cost += information * error.squaredNorm();
  }
};

void add_setup_priors(const StartProblem& problem,
                      const PreintegrationChain& chain,
                      const InertialSetup& setup,
                      double log_scale_sigma,
                      UnknownsEquations& equations) {
  const InertialStartOptions& options = problem.options;
  const auto one = [](double error) { return Eigen::VectorXd::Constant(1, error); };
  equations.add_prior(2, one(setup.log_scale - options.log_scale), log_scale_sigma);
  // Steps move the lever arm by -R^T; its standard deviation is the same for all axes.
  const Rigid3 believed = problem.imu_from_rig();
  const Eigen::Quaterniond& rotation = setup.imu_from_rig.rotation;
  const Eigen::Vector3d lever_arm =
      setup.imu_from_rig.origin_in_source() - believed.origin_in_source();
  equations.add_prior(3, -(rotation * lever_arm), problem.lever_arm_sigma());
  equations.add_prior(6,
                      so3_log(rotation * believed.rotation.conjugate()),
                      problem.calibration.imu_from_rig ? options.told_rotation_sigma : M_PI);
  const auto& told_shift = problem.calibration.time_shift_s;
  const double time_shift_s = chain.time_shift_s + setup.time_shift_change_s;
  equations.add_prior(9,
                      one(time_shift_s - told_shift.value_or(0.0)),
                      told_shift ? options.told_time_shift_sigma_s : options.time_shift_sigma_s);
}

/// Poses by vision. Their errors are small, so that those of tangent vectors are those of steps.
/// Biases are new where samples are missing before a pose.
void add_state_priors(const StartProblem& problem,
                      const PreintegrationChain& chain,
                      const InertialUnknowns& unknowns,
                      UnknownsEquations& equations) {
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    const Vector6d error =
        (unknowns.states[i].rig_from_world * problem.poses[i].rig_from_world.inverse()).log();
    const auto at = 10 + 15 * static_cast<Eigen::Index>(i);
    double position_sigma = problem.options.pose_position_sigma;
    double rotation_sigma = problem.options.pose_rotation_sigma;
    const double squared = (error.head<3>() / position_sigma).squaredNorm() +
                           (error.tail<3>() / rotation_sigma).squaredNorm();
    const RobustValue robust = huber(squared, problem.options.pose_huber);
    const double factor = problem.poses[i].is_seen ? 1.0 / std::sqrt(robust.weight) : kUnseen;
    position_sigma *= factor;
    rotation_sigma *= factor;
    equations.add_prior(at, error.head<3>(), position_sigma);
    equations.add_prior(at + 3, error.tail<3>(), rotation_sigma);
    if (problem.poses[i].is_seen) equations.cost += robust.loss - robust.weight * squared;
    equations.add_prior(at + 6, unknowns.states[i].velocity, kAnySpeed);
    if (i > 0 && chain.intervals[i - 1]) continue;
    const ImuBiases& biases = unknowns.states[i].biases;
    equations.add_prior(at + 9, biases.gyroscope, problem.options.gyroscope_bias_sigma);
    equations.add_prior(at + 12, biases.accelerometer, problem.options.accelerometer_bias_sigma);
  }
}

UnknownsEquations linearize_unknowns(const StartProblem& problem,
                                     const PreintegrationChain& chain,
                                     double log_scale_sigma,
                                     const InertialUnknowns& unknowns) {
  UnknownsEquations equations(unknowns.states.size());
  add_setup_priors(problem, chain, unknowns.setup, log_scale_sigma, equations);
  add_state_priors(problem, chain, unknowns, equations);
  Eigen::Matrix<double, 15, 30> by_states;
  for (std::size_t i = 0; i < chain.intervals.size(); ++i) {
    if (!chain.intervals[i]) continue;
    const InertialState& first = unknowns.states[i];
    const InertialState& second = unknowns.states[i + 1];
    InertialResidual residual =
        inertial_residual(*chain.intervals[i], first, second, unknowns.setup);
    residual.by_setup.col(2) += residual.by_first.middleCols<3>(6) * first.velocity +
                                residual.by_second.middleCols<3>(6) * second.velocity;
    const auto at = 10 + 15 * static_cast<Eigen::Index>(i);
    by_states << residual.by_first, residual.by_second;
    equations.hessian.add(i, by_states, residual.by_setup);
    equations.gradient.segment<30>(at) += by_states.transpose() * residual.value;
    equations.gradient.head<10>() += residual.by_setup.transpose() * residual.value;
    equations.cost += residual.value.squaredNorm();
  }
  return equations;
}

/// By the last equations, of the tangent vectors themselves, in which velocities do not grow with
/// the scale.
std::vector<Matrix25d> covariances_of(const ChainHessian& hessian,
                                      std::span<const InertialState> states) {
  std::vector<Matrix25d> covariances = hessian.covariances();
  for (std::size_t i = 0; i < states.size(); ++i) {
    Matrix25d by_step = Matrix25d::Identity();
    by_step.block<3, 1>(16, 2) = states[i].velocity;
    const Matrix25d covariance = by_step * covariances[i] * by_step.transpose();
    covariances[i] = 0.5 * (covariance + covariance.transpose());
  }
  return covariances;
}

}  // namespace

InertialRefinement refine_inertial_start(const StartProblem& problem,
                                         const PreintegrationChain& chain,
                                         InertialUnknowns unknowns,
                                         double log_scale_sigma) {
  WAYMARK_CHECK(unknowns.states.size() == problem.poses.size());
  SteppedUnknowns stepped{{std::move(unknowns)}};
  int num_iterations = 0;
  const UnknownsEquations last = minimize_over_pose(
      stepped,
      [&](const SteppedUnknowns& at) {
        return linearize_unknowns(problem, chain, log_scale_sigma, at);
      },
      kMaxRefinements,
      kNegligibleError,
      num_iterations);
  std::vector<Matrix25d> covariances = covariances_of(last.hessian, stepped.states);
  return {std::move(stepped), std::move(covariances), last.cost};
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/inertial_refinement.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/solver/levenberg_marquardt.h"

namespace waymark {
namespace {

constexpr int kMaxRefinements = 30;
/// Of the squared error, which is in standard deviations.
constexpr double kNegligibleError = 1e-2;

/// What a velocity is below in m/s, where nothing tells it.
constexpr double kAnySpeed = 1000.0;

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

/// Of a few hundred rows, for which Eigen's LLT by blocks is several times as fast as its LDLT.
struct UnknownsHessian : Eigen::MatrixXd {
  using Eigen::MatrixXd::MatrixXd;
  using Eigen::MatrixXd::operator=;
  auto ldlt() const { return llt(); }
};

/// NormalEquations of a size that is known only when it runs.
struct UnknownsEquations {
  UnknownsHessian hessian;
  Eigen::VectorXd gradient;
  double cost = 0.0;

  explicit UnknownsEquations(Eigen::Index size)
      : hessian(Eigen::MatrixXd::Zero(size, size)), gradient(Eigen::VectorXd::Zero(size)) {}
  /// Components from there on that are off by so much, with one standard deviation.
  void add_prior(Eigen::Index at, const Eigen::VectorXd& error, double sigma) {
    const double information = 1.0 / (sigma * sigma);
    hessian.diagonal().segment(at, error.size()).array() += information;
    gradient.segment(at, error.size()) += information * error;
    cost += information * error.squaredNorm();
  }
};

struct RefinementProblem {
  std::span<const VisionPose> poses;
  const PreintegrationChain& chain;
  const InertialBelief& belief;
  const InertialStartOptions& options;
};

void add_setup_priors(const RefinementProblem& problem,
                      const InertialUnknowns& unknowns,
                      UnknownsEquations& equations) {
  const InertialSetup& setup = unknowns.setup;
  const InertialBelief& belief = problem.belief;
  equations.add_prior(
      2, Eigen::VectorXd::Constant(1, setup.log_scale - belief.log_scale), belief.log_scale_sigma);
  // Steps move the lever arm by -R^T; its standard deviation is the same for all axes.
  const Eigen::Vector3d lever_arm =
      setup.imu_from_rig.origin_in_source() - belief.imu_from_rig.origin_in_source();
  equations.add_prior(3, -(setup.imu_from_rig.rotation * lever_arm), belief.lever_arm_sigma);
  equations.add_prior(
      6,
      so3_log(setup.imu_from_rig.rotation * belief.imu_from_rig.rotation.conjugate()),
      belief.rotation_sigma);
  equations.add_prior(
      9,
      Eigen::VectorXd::Constant(1, setup.time_shift_change_s - belief.time_shift_change_s),
      belief.time_shift_sigma_s);
}

/// Poses by vision. Their errors are small, so that those of tangent vectors are those of steps.
/// Biases are new where samples are missing before a pose.
void add_state_priors(const RefinementProblem& problem,
                      const InertialUnknowns& unknowns,
                      UnknownsEquations& equations) {
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    const Vector6d error =
        (unknowns.states[i].rig_from_world * problem.poses[i].rig_from_world.inverse()).log();
    const auto at = 10 + 15 * static_cast<Eigen::Index>(i);
    equations.add_prior(at, error.head<3>(), problem.options.pose_position_sigma);
    equations.add_prior(at + 3, error.tail<3>(), problem.options.pose_rotation_sigma);
    equations.add_prior(at + 6, unknowns.states[i].velocity, kAnySpeed);
    if (i > 0 && problem.chain[i - 1]) continue;
    const ImuBiases& biases = unknowns.states[i].biases;
    equations.add_prior(at + 9, biases.gyroscope, problem.options.gyroscope_bias_sigma);
    equations.add_prior(at + 12, biases.accelerometer, problem.options.accelerometer_bias_sigma);
  }
}

UnknownsEquations linearize_unknowns(const RefinementProblem& problem,
                                     const InertialUnknowns& unknowns) {
  UnknownsEquations equations(10 + 15 * static_cast<Eigen::Index>(unknowns.states.size()));
  add_setup_priors(problem, unknowns, equations);
  add_state_priors(problem, unknowns, equations);
  Eigen::Matrix<double, 15, 30> by_states;
  for (std::size_t i = 0; i < problem.chain.size(); ++i) {
    if (!problem.chain[i]) continue;
    const InertialState& first = unknowns.states[i];
    const InertialState& second = unknowns.states[i + 1];
    InertialResidual residual = inertial_residual(*problem.chain[i], first, second, unknowns.setup);
    residual.by_setup.col(2) += residual.by_first.middleCols<3>(6) * first.velocity +
                                residual.by_second.middleCols<3>(6) * second.velocity;
    const auto at = 10 + 15 * static_cast<Eigen::Index>(i);
    by_states << residual.by_first, residual.by_second;
    equations.hessian.block<30, 30>(at, at) += by_states.transpose() * by_states;
    equations.hessian.block<30, 10>(at, 0) += by_states.transpose() * residual.by_setup;
    equations.hessian.block<10, 10>(0, 0) += residual.by_setup.transpose() * residual.by_setup;
    equations.gradient.segment<30>(at) += by_states.transpose() * residual.value;
    equations.gradient.head<10>() += residual.by_setup.transpose() * residual.value;
    equations.cost += residual.value.squaredNorm();
  }
  const Eigen::Index num_of_states = equations.hessian.rows() - 10;
  equations.hessian.topRightCorner(10, num_of_states) =
      equations.hessian.bottomLeftCorner(num_of_states, 10).transpose();
  return equations;
}

/// Covariance and determinant of the last equations; none where rounding has left them singular.
void judge(const Eigen::MatrixXd& hessian, InertialRefinement& refined) {
  const Eigen::Index size = hessian.rows();
  Eigen::MatrixXd units = Eigen::MatrixXd::Zero(size, 25);
  units.topLeftCorner<10, 10>().setIdentity();
  units.bottomRightCorner<15, 15>().setIdentity();
  const Eigen::LLT<Eigen::MatrixXd> factor(hessian);
  if (factor.info() != Eigen::Success) {
    refined.covariance.setConstant(std::numeric_limits<double>::quiet_NaN());
    refined.log_determinant = std::numeric_limits<double>::infinity();
    return;
  }
  // Of the tangent vectors themselves, in which velocities do not grow with the scale.
  Matrix25d by_step = Matrix25d::Identity();
  by_step.block<3, 1>(16, 2) = refined.unknowns.states.back().velocity;
  const Matrix25d covariance =
      by_step * (units.transpose() * factor.solve(units)) * by_step.transpose();
  refined.covariance = 0.5 * (covariance + covariance.transpose());
  refined.log_determinant = 2.0 * factor.matrixLLT().diagonal().array().log().sum();
}

}  // namespace

InertialRefinement refine_inertial_start(std::span<const VisionPose> poses,
                                         const PreintegrationChain& chain,
                                         InertialUnknowns unknowns,
                                         const InertialBelief& belief,
                                         const InertialStartOptions& options) {
  WAYMARK_CHECK(unknowns.states.size() == poses.size() && chain.size() + 1 == poses.size());
  const RefinementProblem problem{poses, chain, belief, options};
  SteppedUnknowns stepped{{std::move(unknowns)}};
  int num_iterations = 0;
  const UnknownsEquations last = minimize_over_pose(
      stepped,
      [&](const SteppedUnknowns& at) { return linearize_unknowns(problem, at); },
      kMaxRefinements,
      kNegligibleError,
      num_iterations);
  InertialRefinement refined;
  refined.unknowns = std::move(stepped);
  refined.squared_error = last.cost;
  judge(last.hessian, refined);
  return refined;
}

}  // namespace waymark

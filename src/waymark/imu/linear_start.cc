// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/linear_start.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "waymark/base/check.h"

namespace waymark {
namespace {

/// In which weights and the direction of gravity become those of the solution.
constexpr int kLinearRounds = 4;
/// Of scale in relation to the one believed, of velocities in m/s: they only keep the equations
/// solvable.
constexpr double kAnyScale = 30.0;
constexpr double kAnyVelocity = 100.0;
/// Of the size of gravity, m/s^2: a condition, next to noise.
constexpr double kGravitySizeSigma = 0.001;
/// The least scale to go on from, in relation to the one believed. Less is noise.
constexpr double kLeastScale = 0.02;

/// Columns of the unknowns, followed by the velocities.
constexpr Eigen::Index kScale = 0, kGravity = 1, kLeverArm = 4, kBias = 7, kVelocities = 10;

using Matrix3Xd = Eigen::Matrix<double, 3, Eigen::Dynamic>;

struct LinearEquations {
  Eigen::MatrixXd hessian;
  Eigen::VectorXd right;

  explicit LinearEquations(Eigen::Index size)
      : hessian(Eigen::MatrixXd::Zero(size, size)), right(Eigen::VectorXd::Zero(size)) {}
  void add(const Matrix3Xd& rows, const Eigen::Vector3d& value, double variance) {
    hessian.selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose(), 1.0 / variance);
    right += rows.transpose() * value / variance;
  }
  void add_prior(Eigen::Index at, double value, double sigma) {
    hessian(at, at) += 1.0 / (sigma * sigma);
    right[at] += value / (sigma * sigma);
  }
};

struct LinearProblem {
  std::span<const VisionPose> poses;
  const PreintegrationChain& chain;
  const Rigid3& imu_from_rig;
  double lever_arm_sigma;
  const InertialStartOptions& options;
};

/// Adds how velocity and position changed between a pose and the next.
void add_interval(const LinearProblem& problem,
                  std::size_t i,
                  double scale,
                  LinearEquations& equations) {
  const Preintegration& measured = *problem.chain[i];
  const Rigid3& first = problem.poses[i].rig_from_world;
  const Rigid3& second = problem.poses[i + 1].rig_from_world;
  const double t = measured.duration_s();
  const Eigen::Matrix3d world_from_rig = first.rotation_matrix().transpose();
  const Eigen::Matrix3d world_from_imu =
      world_from_rig * problem.imu_from_rig.rotation_matrix().transpose();
  const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
  const auto velocity_at = kVelocities + 3 * static_cast<Eigen::Index>(i);
  // A pose that is turned wrongly turns what pushes against gravity.
  const double tilt = problem.options.pose_rotation_sigma * problem.options.gravity * t;
  const double place = scale * problem.options.pose_position_sigma;
  const Matrix9d covariance = measured.covariance();

  Matrix3Xd rows = Matrix3Xd::Zero(3, equations.right.size());
  rows.middleCols<3>(kGravity) = -t * one;
  rows.middleCols<3>(kBias) = -world_from_imu * measured.by_biases().block<3, 3>(3, 3);
  rows.middleCols<3>(velocity_at) = -one;
  rows.middleCols<3>(velocity_at + 3) = one;
  equations.add(rows,
                world_from_imu * measured.delta().velocity,
                covariance.diagonal().segment<3>(3).mean() + tilt * tilt);

  rows.setZero();
  rows.col(kScale) = second.origin_in_source() - first.origin_in_source();
  rows.middleCols<3>(kGravity) = -0.5 * t * t * one;
  rows.middleCols<3>(kLeverArm) = second.rotation_matrix().transpose() - world_from_rig;
  rows.middleCols<3>(kBias) = -world_from_imu * measured.by_biases().block<3, 3>(6, 3);
  rows.middleCols<3>(velocity_at) = -t * one;
  equations.add(
      rows,
      world_from_imu * measured.delta().position,
      covariance.diagonal().tail<3>().mean() + 0.25 * t * t * tilt * tilt + 2.0 * place * place);
}

/// down: the direction of gravity as far as it is known, or 0.
Eigen::VectorXd solve_linear(const LinearProblem& problem,
                             double scale,
                             const Eigen::Vector3d& down) {
  const InertialStartOptions& options = problem.options;
  const auto size = kVelocities + 3 * static_cast<Eigen::Index>(problem.poses.size());
  LinearEquations equations(size);
  for (std::size_t i = 0; i < problem.chain.size(); ++i) {
    if (problem.chain[i]) add_interval(problem, i, scale, equations);
  }
  const double believed = std::exp(options.log_scale);
  equations.add_prior(kScale, believed, kAnyScale * believed);
  const Eigen::Vector3d lever_arm = problem.imu_from_rig.origin_in_source();
  for (Eigen::Index i = 0; i < 3; ++i) {
    equations.add_prior(kGravity + i, 0.0, 10.0 * options.gravity);
    equations.add_prior(kLeverArm + i, lever_arm[i], problem.lever_arm_sigma);
    equations.add_prior(kBias + i, 0.0, options.accelerometer_bias_sigma);
  }
  for (Eigen::Index i = kVelocities; i < size; ++i) equations.add_prior(i, 0.0, kAnyVelocity);
  const double information = 1.0 / (kGravitySizeSigma * kGravitySizeSigma);
  equations.hessian.block<3, 3>(kGravity, kGravity) += information * down * down.transpose();
  equations.right.segment<3>(kGravity) += information * options.gravity * down;
  return equations.hessian.selfadjointView<Eigen::Lower>().ldlt().solve(equations.right);
}

}  // namespace

InertialUnknowns linear_start(std::span<const VisionPose> poses,
                              const PreintegrationChain& chain,
                              const Rigid3& imu_from_rig,
                              double lever_arm_sigma,
                              const InertialStartOptions& options) {
  WAYMARK_CHECK(chain.size() + 1 == poses.size());
  const LinearProblem problem{poses, chain, imu_from_rig, lever_arm_sigma, options};
  const double believed = std::exp(options.log_scale);
  double scale = believed;
  Eigen::Vector3d down = Eigen::Vector3d::Zero();
  Eigen::VectorXd found;
  for (int round = 0; round < kLinearRounds; ++round) {
    found = solve_linear(problem, scale, down);
    scale = std::max(found[kScale], kLeastScale * believed);
    down = found.segment<3>(kGravity).normalized();
  }
  InertialUnknowns unknowns;
  unknowns.setup.gravity = options.gravity * down;
  unknowns.setup.log_scale = std::log(scale);
  unknowns.setup.imu_from_rig = {imu_from_rig.rotation,
                                 -(imu_from_rig.rotation * found.segment<3>(kLeverArm))};
  for (std::size_t i = 0; i < poses.size(); ++i) {
    InertialState state;
    state.rig_from_world = poses[i].rig_from_world;
    state.velocity = found.segment<3>(kVelocities + 3 * static_cast<Eigen::Index>(i));
    state.biases.accelerometer = found.segment<3>(kBias);
    unknowns.states.push_back(state);
  }
  return unknowns;
}

}  // namespace waymark

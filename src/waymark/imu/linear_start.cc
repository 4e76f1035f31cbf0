// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "waymark/base/check.h"
#include "waymark/imu/start_steps.h"

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

/// Adds how velocity and position changed between a pose and the next.
void add_interval(const StartProblem& problem,
                  const Preintegration& measured,
                  const RotationStart& rotation,
                  std::size_t i,
                  double scale,
                  LinearEquations& equations) {
  const Rigid3& first = problem.poses[i].rig_from_world;
  const Rigid3& second = problem.poses[i + 1].rig_from_world;
  const double t = measured.duration_s();
  const Eigen::Matrix3d world_from_rig = first.rotation_matrix().transpose();
  const Eigen::Matrix3d world_from_imu =
      world_from_rig * rotation.imu_from_rig.toRotationMatrix().transpose();
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
Eigen::VectorXd solve_linear(const StartProblem& problem,
                             const PreintegrationChain& chain,
                             const RotationStart& rotation,
                             double scale,
                             const Eigen::Vector3d& down) {
  const InertialStartOptions& options = problem.options;
  const auto size = kVelocities + 3 * static_cast<Eigen::Index>(problem.poses.size());
  LinearEquations equations(size);
  for (std::size_t i = 0; i < chain.intervals.size(); ++i) {
    const auto& measured = chain.intervals[i];
    if (measured) add_interval(problem, *measured, rotation, i, scale, equations);
  }
  const double believed = std::exp(options.log_scale);
  equations.add_prior(kScale, believed, kAnyScale * believed);
  const Eigen::Vector3d lever_arm = problem.imu_from_rig().origin_in_source();
  for (Eigen::Index i = 0; i < 3; ++i) {
    equations.add_prior(kGravity + i, 0.0, 10.0 * options.gravity);
    equations.add_prior(kLeverArm + i, lever_arm[i], problem.lever_arm_sigma());
    equations.add_prior(kBias + i, 0.0, options.accelerometer_bias_sigma);
  }
  for (Eigen::Index i = kVelocities; i < size; ++i) equations.add_prior(i, 0.0, kAnyVelocity);
  const double information = 1.0 / (kGravitySizeSigma * kGravitySizeSigma);
  equations.hessian.block<3, 3>(kGravity, kGravity) += information * down * down.transpose();
  equations.right.segment<3>(kGravity) += information * options.gravity * down;
  return equations.hessian.selfadjointView<Eigen::Lower>().ldlt().solve(equations.right);
}

}  // namespace

InertialUnknowns linear_start(const StartProblem& problem,
                              const PreintegrationChain& chain,
                              const RotationStart& rotation) {
  WAYMARK_CHECK(chain.intervals.size() + 1 == problem.poses.size());
  const double believed = std::exp(problem.options.log_scale);
  double scale = believed;
  Eigen::Vector3d down = Eigen::Vector3d::Zero();
  Eigen::VectorXd found;
  for (int round = 0; round < kLinearRounds; ++round) {
    found = solve_linear(problem, chain, rotation, scale, down);
    scale = std::max(found[kScale], kLeastScale * believed);
    down = found.segment<3>(kGravity).normalized();
  }
  InertialUnknowns unknowns;
  unknowns.setup.gravity = problem.options.gravity * down;
  unknowns.setup.log_scale = std::log(scale);
  unknowns.setup.imu_from_rig = {rotation.imu_from_rig,
                                 -(rotation.imu_from_rig * found.segment<3>(kLeverArm))};
  Eigen::Index at = kVelocities;
  for (const VisionPose& pose : problem.poses) {
    unknowns.states.push_back({pose.rig_from_world,
                               found.segment<3>(at),
                               {rotation.gyroscope_bias, found.segment<3>(kBias)}});
    at += 3;
  }
  return unknowns;
}

}  // namespace waymark

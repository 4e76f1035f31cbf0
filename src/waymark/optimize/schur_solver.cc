// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/schur_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "waymark/optimize/levenberg_marquardt.h"
#include "waymark/optimize/schur_equations.h"

namespace waymark {
namespace {

constexpr double kInitialDamping = 1e-4;
constexpr double kMaxDamping = 1e12;
/// Bounds of the diagonal that the damping scales, so that directions nobody measures stay put.
constexpr double kMinDiagonal = 1e-6;
constexpr double kMaxDiagonal = 1e32;

/// M, lower triangular, with M^T * M the inverse of a positive definite block: the inverse of its
/// Cholesky factor. Pivots that rounding made vanish are kept positive.
Eigen::Matrix3d half_inverse(const Eigen::Matrix3d& block) {
  const double inverse00 = 1.0 / std::sqrt(block(0, 0));
  const double lower10 = block(1, 0) * inverse00;
  const double lower20 = block(2, 0) * inverse00;
  const double inverse11 =
      1.0 / std::sqrt(std::max(block(1, 1) - lower10 * lower10, 1e-15 * block(1, 1)));
  const double lower21 = (block(2, 1) - lower20 * lower10) * inverse11;
  const double pivot22 = block(2, 2) - lower20 * lower20 - lower21 * lower21;
  const double inverse22 = 1.0 / std::sqrt(std::max(pivot22, 1e-15 * block(2, 2)));
  const double inverse10 = -lower10 * inverse00 * inverse11;
  const double inverse21 = -lower21 * inverse11 * inverse22;
  const double inverse20 = -(lower20 * inverse00 + lower21 * inverse10) * inverse22;
  Eigen::Matrix3d half;
  half << inverse00, 0.0, 0.0, inverse10, inverse11, 0.0, inverse20, inverse21, inverse22;
  return half;
}

double clamp_diagonal(double value) { return std::clamp(value, kMinDiagonal, kMaxDiagonal); }

}  // namespace

void SchurSolver::allocate() {
  blocks_.poses.resize(plan_.num_slots);
  blocks_.pose_gradient.resize(plan_.num_slots);
  blocks_.points.resize(plan_.points.size());
  blocks_.point_gradient.resize(plan_.points.size());
  blocks_.links.resize(plan_.slot_of_link.size());
  half_inverses_.resize(plan_.points.size());
  eliminated_.resize(plan_.num_slots);
  reduced_gradient_.resize(static_cast<Eigen::Index>(6 * plan_.num_slots));
  for (std::size_t entry = 0; entry < plan_.points.size(); ++entry) {
    for (std::uint32_t a = plan_.first_link[entry]; a < plan_.first_link[entry + 1]; ++a) {
      for (std::uint32_t b = plan_.first_link[entry]; b <= a; ++b) {
        block_of_links_.push_back(reduced_.index_of(plan_.slot_of_link[a], plan_.slot_of_link[b]));
      }
    }
  }
}

/// first_pair: of the point in block_of_links_; moved to that of the next point.
void SchurSolver::eliminate_point(std::size_t entry, double damping, std::size_t& first_pair) {
  Eigen::Matrix3d block = blocks_.points[entry];
  for (int i = 0; i < 3; ++i) block(i, i) += damping * clamp_diagonal(block(i, i));
  half_inverses_[entry] = half_inverse(block);
  const Eigen::Matrix3d& half = half_inverses_[entry];
  const Eigen::Vector3d gradient = half * blocks_.point_gradient[entry];
  if (border_) border_->eliminate_point(entry, half, gradient);
  const std::uint32_t begin = plan_.first_link[entry];
  const std::uint32_t end = plan_.first_link[entry + 1];
  for (std::uint32_t a = begin; a < end; ++a) {
    Matrix63d& eliminated = eliminated_[a - begin];
    eliminated.noalias() = blocks_.links[a] * half.transpose();
    const auto row = static_cast<Eigen::Index>(6 * plan_.slot_of_link[a]);
    reduced_gradient_.segment<6>(row).noalias() -= eliminated * gradient;
    if (border_) border_->eliminate_link(plan_.slot_of_link[a], eliminated);
    for (std::uint32_t b = begin; b <= a; ++b) {
      reduced_.block(block_of_links_[first_pair++]).noalias() -=
          eliminated * eliminated_[b - begin].transpose();
    }
  }
}

/// Builds the reduced system of the damped equations.
void SchurSolver::eliminate_points(double damping) {
  reduced_.set_zero();
  if (border_) border_->begin_elimination(damping);
  for (std::uint32_t slot = 0; slot < plan_.num_slots; ++slot) {
    const auto row = static_cast<Eigen::Index>(6 * slot);
    Matrix6d& block = reduced_.diagonal(slot);
    block = blocks_.poses[slot];
    for (int i = 0; i < 6; ++i) block(i, i) += damping * clamp_diagonal(block(i, i));
    reduced_gradient_.segment<6>(row) = blocks_.pose_gradient[slot];
  }
  std::size_t first_pair = 0;
  for (std::size_t entry = 0; entry < plan_.points.size(); ++entry) {
    eliminate_point(entry, damping, first_pair);
  }
}

/// Solves for the step of the poses, negated, in place of their gradient.
bool SchurSolver::solve_reduced() {
  if (!reduced_.factorize()) return false;
  if (border_) return border_->solve(reduced_, reduced_gradient_);
  reduced_.solve_in_place(reduced_gradient_);
  return true;
}

/// Takes the step of the poses from reduced_gradient_, moves the candidate, and returns the
/// decrease of the cost that the linear model promises.
double SchurSolver::substitute_back(double damping) {
  double decrease = 0.0;
  const auto promise = [damping, &decrease](
                           const auto& step, const auto& gradient, const auto& diagonal) {
    for (Eigen::Index i = 0; i < step.size(); ++i) {
      decrease += step[i] * (damping * clamp_diagonal(diagonal[i]) * step[i] - gradient[i]);
    }
  };
  for (std::size_t pose = 0; pose < plan_.slot_of_pose.size(); ++pose) {
    const std::uint32_t slot = plan_.slot_of_pose[pose];
    if (slot == kNoSlot) continue;
    const Vector6d step = -reduced_gradient_.segment<6>(static_cast<Eigen::Index>(6 * slot));
    promise(step, blocks_.pose_gradient[slot], blocks_.poses[slot].diagonal());
    candidate_.rig_from_world[pose] = Rigid3::exp(step) * state_.rig_from_world[pose];
    candidate_.matrices[pose] = matrix_of(candidate_.rig_from_world[pose]);
  }
  if (border_) {
    const Eigen::VectorXd step = -border_->solution();
    promise(step, border_->gradient(), border_->diagonal());
    candidate_.calibration = state_.calibration + step;
    move_cameras(candidate_);
  }
  for (std::size_t entry = 0; entry < plan_.points.size(); ++entry) {
    Eigen::Vector3d gradient = blocks_.point_gradient[entry];
    for (std::uint32_t link = plan_.first_link[entry]; link < plan_.first_link[entry + 1]; ++link) {
      const auto row = static_cast<Eigen::Index>(6 * plan_.slot_of_link[link]);
      gradient.noalias() -= blocks_.links[link].transpose() * reduced_gradient_.segment<6>(row);
    }
    if (border_) gradient -= border_->share_of_point(entry);
    const Eigen::Matrix3d& half = half_inverses_[entry];
    const Eigen::Vector3d step = -(half.transpose() * (half * gradient));
    promise(step, blocks_.point_gradient[entry], blocks_.points[entry].diagonal());
    candidate_.points[plan_.points[entry]] = state_.points[plan_.points[entry]] + step;
  }
  return 0.5 * decrease;
}

BundleRound SchurSolver::minimize() {
  BundleRound round;
  round.initial_cost = round.final_cost = cost(state_);
  Damping damping(kInitialDamping);
  bool is_linearized = false;
  while (round.num_iterations < options_.max_iterations_per_round &&
         damping.value() < kMaxDamping) {
    if (!is_linearized) linearize();
    is_linearized = true;
    ++round.num_iterations;
    eliminate_points(damping.value());
    double gain = -1.0;
    double candidate_cost = round.final_cost;
    if (solve_reduced()) {
      const double promised = substitute_back(damping.value());
      if (!(promised > 1e-3 * options_.relative_cost_tolerance * round.final_cost)) break;
      candidate_cost = cost(candidate_);
      gain = (round.final_cost - candidate_cost) / promised;
    }
    if (!(gain > 0.0)) {
      damping.reject();
      continue;
    }
    std::swap(state_, candidate_);
    const double decrease = round.final_cost - candidate_cost;
    round.final_cost = candidate_cost;
    if (decrease < options_.relative_cost_tolerance * candidate_cost) break;
    damping.accept(gain);
    is_linearized = false;
  }
  return round;
}

BundleRound minimize_with_schur(BundleProblem& problem,
                                std::span<const std::uint8_t> is_used,
                                const BundleOptions& options) {
  SchurSolver solver(problem, is_used, options);
  const BundleRound round = solver.minimize();
  problem.rig_from_world = solver.state().rig_from_world;
  problem.points = solver.state().points;
  if (problem.calibration) {
    problem.calibration->change = solver.state().calibration;
    if (options.with_evidence) problem.calibration->evidence = solver.calibration_evidence();
  }
  return round;
}

}  // namespace waymark

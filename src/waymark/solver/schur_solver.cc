// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/solver/schur_solver.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "waymark/geometry/damping.h"
#include "waymark/solver/levenberg_marquardt.h"
#include "waymark/solver/schur_equations.h"

namespace waymark {
namespace {

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

/// Twice the decrease that the linear model promises of a step of some unknowns.
template <class Step, class Gradient, class Diagonal>
double promised(const Step& step,
                const Gradient& gradient,
                const Diagonal& diagonal,
                double damping) {
  double decrease = 0.0;
  for (Eigen::Index i = 0; i < step.size(); ++i) {
    decrease += step[i] * (damping * clamp_diagonal(diagonal[i]) * step[i] - gradient[i]);
  }
  return decrease;
}

}  // namespace

void SchurSolver::allocate() {
  blocks_.poses.resize(plan_.num_slots);
  blocks_.pose_gradient.resize(plan_.num_slots);
  blocks_.points.resize(plan_.points.size());
  blocks_.point_gradient.resize(plan_.points.size());
  blocks_.links.resize(plan_.slot_of_link.size() + 1);
  half_inverses_.resize(plan_.points.size());
  half_gradients_.resize(plan_.points.size());
  reduced_gradient_.resize(static_cast<Eigen::Index>(6 * plan_.num_slots));
  entry_of_link_.reserve(plan_.slot_of_link.size());
  first_link_of_slot_.assign(plan_.num_slots + 1, 0);
  for (std::size_t entry = 0; entry < plan_.points.size(); ++entry) {
    for (std::uint32_t link = plan_.first_link[entry]; link < plan_.first_link[entry + 1]; ++link) {
      entry_of_link_.push_back(static_cast<std::uint32_t>(entry));
      ++first_link_of_slot_[plan_.slot_of_link[link] + 1];
    }
  }
  std::partial_sum(
      first_link_of_slot_.begin(), first_link_of_slot_.end(), first_link_of_slot_.begin());
  links_of_slot_.resize(plan_.slot_of_link.size());
  std::vector<std::size_t> next(first_link_of_slot_.begin(), first_link_of_slot_.end() - 1);
  for (std::uint32_t link = 0; link < plan_.slot_of_link.size(); ++link) {
    links_of_slot_[next[plan_.slot_of_link[link]]++] = link;
  }
}

/// Makes eliminated ones of the links of a point.
void SchurSolver::eliminate_point(std::size_t entry, double damping) {
  Eigen::Matrix3d block = blocks_.points[entry];
  for (int i = 0; i < 3; ++i) block(i, i) += damping * clamp_diagonal(block(i, i));
  const Eigen::Matrix3d half = half_inverse(block);
  half_inverses_[entry] = half;
  half_gradients_[entry].noalias() = half * blocks_.point_gradient[entry];
  for (std::uint32_t link = plan_.first_link[entry]; link < plan_.first_link[entry + 1]; ++link) {
    const Matrix63d before = blocks_.links[link];
    blocks_.links[link].noalias() = before * half.transpose();
  }
}

/// Sums up a column of the reduced system: what its slot has to do with itself and with later ones.
/// places: of slots in the panel; sums: a padded block for each place, zero.
void SchurSolver::reduce_column(std::uint32_t slot,
                                std::span<const std::uint32_t> places,
                                double* sums) {
  Vector6d gradient = blocks_.pose_gradient[slot];
  std::vector<std::uint32_t> at;
  for (std::size_t i = first_link_of_slot_[slot]; i < first_link_of_slot_[slot + 1]; ++i) {
    const std::uint32_t link = links_of_slot_[i];
    const std::uint32_t entry = entry_of_link_[link];
    at.clear();
    for (std::uint32_t other = link; other < plan_.first_link[entry + 1]; ++other) {
      at.push_back(places[plan_.slot_of_link[other]]);
    }
    subtract_point_products(blocks_.links[link].data(), at, sums);
    gradient.noalias() -= blocks_.links[link] * half_gradients_[entry];
    if (border_) border_->eliminate_link(slot, entry, blocks_.links[link]);
  }
  reduced_gradient_.segment<6>(static_cast<Eigen::Index>(6 * slot)) = gradient;
}

void SchurSolver::reduce_panel(std::size_t index, double damping) {
  constexpr std::size_t kSize = kBlockRows * kPaddedBlockRows;
  const FactorPanels::Panel& panel = reduced_.plan().panels[index];
  const auto rows = reduced_.plan().rows_of(panel);
  std::vector<std::uint32_t> places(rows.back() + 1);
  for (std::uint32_t i = 0; i < rows.size(); ++i) places[rows[i]] = i;
  std::vector<double> sums(kSize * rows.size());
  for (std::uint32_t slot = panel.begin; slot < panel.end; ++slot) {
    std::fill(sums.begin(), sums.end(), 0.0);
    Matrix6d block = blocks_.poses[slot];
    for (int i = 0; i < 6; ++i) block(i, i) += damping * clamp_diagonal(block(i, i));
    Eigen::Map<Eigen::Matrix<double, kPaddedBlockRows, 6>>(sums.data() +
                                                           kSize * (slot - panel.begin))
        .topRows<6>() = block;
    add_motion_column(slot, places, sums.data());
    reduce_column(slot, places, sums.data());
    reduced_.set_column(index, slot - panel.begin, sums);
  }
}

void SchurSolver::reduce(double damping) {
  const std::size_t num_points = plan_.points.size();
  threads_.for_chunks(num_points, kNumPointsAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t entry = begin; entry < end; ++entry) eliminate_point(entry, damping);
  });
  if (border_) {
    border_->begin_elimination(damping);
    for (std::size_t entry = 0; entry < num_points; ++entry) {
      border_->eliminate_point(entry, half_inverses_[entry], half_gradients_[entry]);
    }
  }
  threads_.for_chunks(reduced_.plan().panels.size(), 1, [&](std::size_t panel, std::size_t) {
    reduce_panel(panel, damping);
  });
}

/// Solves for the step of the poses, negated, in place of their gradient.
bool SchurSolver::solve_reduced() {
  if (!reduced_.factorize(threads_)) return false;
  if (border_) return border_->solve(reduced_, reduced_gradient_);
  reduced_.solve_in_place(reduced_gradient_);
  return true;
}

/// Moves a point of the candidate, and returns twice the decrease that the linear model promises of
/// it. What a link has to do with the step of its pose is as it was, times M.
double SchurSolver::move_point(std::size_t entry, double damping) {
  Eigen::Vector3d gradient = half_gradients_[entry];
  for (std::uint32_t link = plan_.first_link[entry]; link < plan_.first_link[entry + 1]; ++link) {
    const auto row = static_cast<Eigen::Index>(6 * plan_.slot_of_link[link]);
    gradient.noalias() -= blocks_.links[link].transpose() * reduced_gradient_.segment<6>(row);
  }
  if (border_) gradient -= border_->share_of_point(entry);
  const Eigen::Vector3d step = -(half_inverses_[entry].transpose() * gradient);
  candidate_.points[plan_.points[entry]] = state_.points[plan_.points[entry]] + step;
  return promised(step, blocks_.point_gradient[entry], blocks_.points[entry].diagonal(), damping);
}

/// Takes the step of the poses from reduced_gradient_, moves the candidate, and returns the
/// decrease of the cost that the linear model promises.
double SchurSolver::substitute_back(double damping) {
  double decrease = 0.0;
  for (std::size_t pose = 0; pose < plan_.slot_of_pose.size(); ++pose) {
    const std::uint32_t slot = plan_.slot_of_pose[pose];
    if (slot == kNoSlot) continue;
    const Vector6d step = -reduced_gradient_.segment<6>(static_cast<Eigen::Index>(6 * slot));
    decrease +=
        promised(step, blocks_.pose_gradient[slot], blocks_.poses[slot].diagonal(), damping);
    candidate_.rig_from_world[pose] = Rigid3::exp(step) * state_.rig_from_world[pose];
    candidate_.matrices[pose] = matrix_of(candidate_.rig_from_world[pose]);
  }
  for (std::size_t i = 0; i < plan_.slot_of_unknown.size(); ++i) {
    const std::uint32_t slot = plan_.slot_of_unknown[i];
    const Vector6d step = -reduced_gradient_.segment<6>(static_cast<Eigen::Index>(6 * slot));
    decrease +=
        promised(step, blocks_.pose_gradient[slot], blocks_.poses[slot].diagonal(), damping);
    candidate_.unknowns[i] = state_.unknowns[i] + step;
  }
  if (border_) {
    const Eigen::VectorXd step = -border_->solution();
    decrease += promised(step, border_->gradient(), border_->diagonal(), damping);
    candidate_.calibration = state_.calibration + step;
    move_cameras(candidate_);
  }
  decrease += sum_over(plan_.points.size(), [&](std::size_t begin, std::size_t end) {
    double sum = 0.0;
    for (std::size_t entry = begin; entry < end; ++entry) sum += move_point(entry, damping);
    return sum;
  });
  return 0.5 * decrease;
}

BundleRound SchurSolver::minimize() {
  BundleRound round;
  round.initial_cost = round.final_cost = cost(state_);
  Damping damping(options_.initial_damping);
  while (round.num_iterations < options_.max_iterations_per_round &&
         damping.value() < kMaxDamping) {
    linearize();
    ++round.num_iterations;
    reduce(damping.value());
    double gain = -1.0;
    double candidate_cost = round.final_cost;
    if (solve_reduced()) {
      const double decrease = substitute_back(damping.value());
      if (!(decrease > 1e-3 * options_.relative_cost_tolerance * round.final_cost)) break;
      candidate_cost = cost(candidate_);
      gain = (round.final_cost - candidate_cost) / decrease;
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
  if (problem.motion) problem.motion->unknowns = solver.state().unknowns;
  if (problem.calibration) {
    problem.calibration->change = solver.state().calibration;
    if (options.with_evidence) problem.calibration->evidence = solver.calibration_evidence();
  }
  return round;
}

}  // namespace waymark

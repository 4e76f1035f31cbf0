// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/schur_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "waymark/optimize/levenberg_marquardt.h"
#include "waymark/optimize/residual.h"

namespace waymark {

namespace {

using Matrix63d = Eigen::Matrix<double, 6, 3>;

constexpr double kInitialDamping = 1e-4;
constexpr double kMaxDamping = 1e12;
/// Bounds of the diagonal that the damping scales, so that directions nobody measures stay put.
constexpr double kMinDiagonal = 1e-6;
constexpr double kMaxDiagonal = 1e32;

/// A Rigid3 with its rotation as a matrix, ready to be applied often.
struct RigidMatrix {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
};

RigidMatrix matrix_of(const Rigid3& pose) { return {pose.rotation_matrix(), pose.translation}; }

inline Eigen::Vector3d apply(const RigidMatrix& b_from_a, const Eigen::Vector3d& point_in_a) {
  Eigen::Vector3d point_in_b = b_from_a.translation;
  point_in_b.noalias() += b_from_a.rotation * point_in_a;
  return point_in_b;
}

/// What the solver moves.
struct State {
  std::vector<Rigid3> rig_from_world;
  std::vector<RigidMatrix> matrices;  // The same.
  std::vector<Eigen::Vector3d> points;
};

/// Blocks of the normal equations H * step = -gradient.
struct NormalBlocks {
  std::vector<Matrix6d> poses;          // Per slot.
  std::vector<Vector6d> pose_gradient;  // Per slot.
  std::vector<Eigen::Matrix3d> points;  // Per entry of SchurPlan::points.
  std::vector<Eigen::Vector3d> point_gradient;
  std::vector<Matrix63d> links;  // Pose by point.
};

/// Residual rows of one observation (bearing, bearing, range) times the root of their weight.
template <int kRows>
struct Rows {
  Eigen::Matrix<double, kRows, 1> residual;
  Eigen::Matrix<double, kRows, 3> by_point_in_cam;
};

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

class SchurSolver {
 public:
  SchurSolver(const BundleProblem& problem,
              std::span<const std::uint8_t> is_used,
              const BundleOptions& options)
      : problem_(problem),
        options_(options),
        plan_(make_schur_plan(problem, is_used)),
        reduced_(plan_.num_slots, plan_.pattern) {
    state_.rig_from_world = problem.rig_from_world;
    state_.points = problem.points;
    for (const Rigid3& pose : state_.rig_from_world) state_.matrices.push_back(matrix_of(pose));
    list_cameras();
    candidate_ = state_;
    allocate();
  }

  BundleRound minimize();
  const State& state() const { return state_; }

 private:
  void list_cameras();
  const RigidMatrix& camera_of(const BundleObservation& observation) const {
    return cameras_[first_camera_[observation.pose] + observation.camera];
  }
  void allocate();
  double cost(const State& state) const;
  void linearize();
  template <int kRows>
  void accumulate(const Rows<kRows>& rows,
                  std::size_t entry,
                  std::size_t k,
                  const Eigen::Vector3d& point_in_rig);
  void linearize_observation(std::size_t entry, std::size_t k);
  void eliminate_points(double damping);
  void eliminate_point(std::size_t entry, double damping, std::size_t& first_pair);
  double substitute_back(double damping);

  const BundleProblem& problem_;
  const BundleOptions& options_;
  const SchurPlan plan_;
  std::vector<RigidMatrix> cameras_;       // Of each rig.
  std::vector<std::size_t> first_camera_;  // Of the rig of each pose.
  State state_;
  State candidate_;
  NormalBlocks blocks_;
  std::vector<Eigen::Matrix3d> half_inverses_;  // M with M^T * M = inverse of the damped block.
  std::vector<Matrix63d> eliminated_;           // Links of one point times M^T.
  BlockCholesky reduced_;
  std::vector<std::uint32_t> block_of_links_;  // In reduced_, per pair of links of a point.
  Eigen::VectorXd reduced_gradient_;
};

void SchurSolver::list_cameras() {
  std::vector<std::pair<const Rig*, std::size_t>> listed;
  for (const Rig* rig : problem_.rigs) {
    auto at = std::find_if(
        listed.begin(), listed.end(), [&](const auto& entry) { return entry.first == rig; });
    if (at == listed.end()) {
      at = listed.insert(at, {rig, cameras_.size()});
      for (const RigCamera& camera : rig->cameras)
        cameras_.push_back(matrix_of(camera.cam_from_rig));
    }
    first_camera_.push_back(at->second);
  }
}

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

double SchurSolver::cost(const State& state) const {
  double sum = 0.0;
  for (const std::uint32_t i : plan_.observations) {
    const BundleObservation& observation = problem_.observations[i];
    const Eigen::Vector3d point_in_rig =
        apply(state.matrices[observation.pose], state.points[observation.point]);
    const InverseRangePoint seen = in_inverse_range(apply(camera_of(observation), point_in_rig));
    if (!is_ahead(seen, observation.bearing)) {
      sum += huber(kGrossSquaredResidual, options_.huber_px).loss;
      continue;
    }
    const Eigen::Vector2d residual =
        bearing_residual(seen, observation.bearing, observation.level_pixel_from_bearing);
    sum += huber(residual.squaredNorm(), options_.huber_px).loss;
    if (observation.inverse_range_sigma > 0.0f) {
      const double range =
          range_residual(seen, observation.inverse_range, observation.inverse_range_sigma);
      sum += huber(range * range, options_.range_huber).loss;
    }
  }
  return 0.5 * sum;
}

template <int kRows>
void SchurSolver::accumulate(const Rows<kRows>& rows,
                             std::size_t entry,
                             std::size_t k,
                             const Eigen::Vector3d& point_in_rig) {
  using Rows3 = Eigen::Matrix<double, kRows, 3>;
  const BundleObservation& observation = problem_.observations[plan_.observations[k]];
  const Rows3 by_rig = rows.by_point_in_cam * camera_of(observation).rotation;
  const Rows3 by_point = by_rig * state_.matrices[observation.pose].rotation;
  blocks_.points[entry].noalias() += by_point.transpose() * by_point;
  blocks_.point_gradient[entry].noalias() += by_point.transpose() * rows.residual;
  const std::uint32_t link = plan_.link_of_observation[k];
  if (link == kNoSlot) return;
  Eigen::Matrix<double, kRows, 6> by_pose;
  by_pose.template leftCols<3>() = by_rig;
  for (int row = 0; row < kRows; ++row) {
    const Eigen::Vector3d gradient = by_rig.row(row).transpose();
    by_pose.template block<1, 3>(row, 3) = point_in_rig.cross(gradient).transpose();
  }
  const std::uint32_t slot = plan_.slot_of_link[link];
  blocks_.poses[slot].noalias() += by_pose.transpose() * by_pose;
  blocks_.pose_gradient[slot].noalias() += by_pose.transpose() * rows.residual;
  blocks_.links[link].noalias() += by_pose.transpose() * by_point;
}

void SchurSolver::linearize_observation(std::size_t entry, std::size_t k) {
  const BundleObservation& observation = problem_.observations[plan_.observations[k]];
  const Eigen::Vector3d point_in_rig =
      apply(state_.matrices[observation.pose], state_.points[observation.point]);
  const InverseRangePoint seen = in_inverse_range(apply(camera_of(observation), point_in_rig));
  if (!is_ahead(seen, observation.bearing)) return;
  const Eigen::Vector2d residual =
      bearing_residual(seen, observation.bearing, observation.level_pixel_from_bearing);
  const double root = std::sqrt(huber(residual.squaredNorm(), options_.huber_px).weight);
  const Matrix23d by_point = bearing_residual_by_point(seen, observation.level_pixel_from_bearing);
  if (!(observation.inverse_range_sigma > 0.0f)) {
    accumulate<2>({root * residual, root * by_point}, entry, k, point_in_rig);
    return;
  }
  const double sigma = observation.inverse_range_sigma;
  const double range = range_residual(seen, observation.inverse_range, sigma);
  const double range_root = std::sqrt(huber(range * range, options_.range_huber).weight);
  Rows<3> rows;
  rows.residual << root * residual, range_root * range;
  rows.by_point_in_cam << root * by_point, range_root * range_residual_by_point(seen, sigma);
  accumulate<3>(rows, entry, k, point_in_rig);
}

void SchurSolver::linearize() {
  for (Matrix6d& block : blocks_.poses) block.setZero();
  for (Vector6d& gradient : blocks_.pose_gradient) gradient.setZero();
  for (Matrix63d& link : blocks_.links) link.setZero();
  for (std::size_t entry = 0; entry < plan_.points.size(); ++entry) {
    blocks_.points[entry].setZero();
    blocks_.point_gradient[entry].setZero();
    for (std::size_t k = plan_.first_observation[entry]; k < plan_.first_observation[entry + 1];
         ++k) {
      linearize_observation(entry, k);
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
  const std::uint32_t begin = plan_.first_link[entry];
  const std::uint32_t end = plan_.first_link[entry + 1];
  for (std::uint32_t a = begin; a < end; ++a) {
    Matrix63d& eliminated = eliminated_[a - begin];
    eliminated.noalias() = blocks_.links[a] * half.transpose();
    const auto row = static_cast<Eigen::Index>(6 * plan_.slot_of_link[a]);
    reduced_gradient_.segment<6>(row).noalias() -= eliminated * gradient;
    for (std::uint32_t b = begin; b <= a; ++b) {
      reduced_.block(block_of_links_[first_pair++]).noalias() -=
          eliminated * eliminated_[b - begin].transpose();
    }
  }
}

/// Builds the reduced system of the damped equations.
void SchurSolver::eliminate_points(double damping) {
  reduced_.set_zero();
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
  for (std::size_t entry = 0; entry < plan_.points.size(); ++entry) {
    Eigen::Vector3d gradient = blocks_.point_gradient[entry];
    for (std::uint32_t link = plan_.first_link[entry]; link < plan_.first_link[entry + 1]; ++link) {
      const auto row = static_cast<Eigen::Index>(6 * plan_.slot_of_link[link]);
      gradient.noalias() -= blocks_.links[link].transpose() * reduced_gradient_.segment<6>(row);
    }
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
    if (reduced_.factorize()) {
      reduced_.solve_in_place(reduced_gradient_);
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

}  // namespace

BundleRound minimize_with_schur(BundleProblem& problem,
                                std::span<const std::uint8_t> is_used,
                                const BundleOptions& options) {
  SchurSolver solver(problem, is_used, options);
  const BundleRound round = solver.minimize();
  problem.rig_from_world = solver.state().rig_from_world;
  problem.points = solver.state().points;
  return round;
}

}  // namespace waymark

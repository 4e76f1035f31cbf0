// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "waymark/solver/bundle_motion.h"
#include "waymark/solver/schur_equations.h"

namespace waymark {

BundleMotion::Rows BundleMotion::rows(std::size_t term,
                                      const std::vector<Rigid3>& rig_from_world,
                                      const std::vector<Vector6d>& values) const {
  std::array<Rigid3, kNumPoses> poses;
  std::array<Vector6d, kNumUnknowns> of_term;
  for (std::size_t i = 0; i < kNumPoses; ++i) poses[i] = rig_from_world[terms[term].poses[i]];
  for (std::size_t i = 0; i < kNumUnknowns; ++i) of_term[i] = values[terms[term].unknowns[i]];
  return evaluate(term, poses, of_term);
}

double BundleMotion::mean_squared_residual(const std::vector<Rigid3>& rig_from_world) const {
  double sum = 0.0;
  for (std::size_t term = 0; term < terms.size(); ++term) {
    sum += rows(term, rig_from_world, unknowns).residual.squaredNorm() / 15.0;
  }
  return terms.empty() ? 0.0 : sum / static_cast<double>(terms.size());
}

SlotsOfTerm slots_of(const BundleMotion::Term& term, const SchurStructure& plan) {
  SlotsOfTerm slots;
  auto slot = slots.begin();
  for (const std::uint32_t pose : term.poses) *slot++ = plan.slot_of_pose[pose];
  for (const std::uint32_t unknown : term.unknowns) *slot++ = plan.slot_of_unknown[unknown];
  return slots;
}

/// Twice, but for the factor of the whole.
double SchurSolver::motion_cost(const BundleState& state) const {
  if (!problem_.motion) return 0.0;
  const BundleMotion& motion = *problem_.motion;
  double sum = 0.0;
  for (std::size_t term = 0; term < motion.terms.size(); ++term) {
    sum += motion.rows(term, state.rig_from_world, state.unknowns).residual.squaredNorm();
  }
  for (std::size_t i = 0; i < state.unknowns.size(); ++i) {
    const Vector6d off = state.unknowns[i] - motion.prior[i];
    sum += off.dot(motion.prior_information[i].cwiseProduct(off));
  }
  return motion.noise_px * motion.noise_px * sum;
}

void SchurSolver::add_motion() {
  if (!problem_.motion) return;
  const BundleMotion& motion = *problem_.motion;
  const double weight = motion.noise_px * motion.noise_px;
  motion_blocks_.clear();
  for (std::size_t term = 0; term < motion.terms.size(); ++term) {
    const BundleMotion::Rows rows = motion.rows(term, state_.rig_from_world, state_.unknowns);
    const SlotsOfTerm slots = slots_of(motion.terms[term], plan_);
    const auto by = [&](std::size_t i) {
      return rows.by_blocks.middleCols<6>(static_cast<Eigen::Index>(6 * i));
    };
    for (std::size_t i = 0; i < slots.size(); ++i) {
      if (slots[i] == kNoSlot) continue;
      blocks_.poses[slots[i]].noalias() += weight * by(i).transpose() * by(i);
      blocks_.pose_gradient[slots[i]].noalias() += weight * by(i).transpose() * rows.residual;
      for (std::size_t j = 0; j < slots.size(); ++j) {
        if (slots[j] == kNoSlot || slots[j] <= slots[i]) continue;
        motion_blocks_.push_back({slots[i], slots[j], weight * by(j).transpose() * by(i)});
      }
    }
  }
  for (std::size_t i = 0; i < state_.unknowns.size(); ++i) {
    const std::uint32_t slot = plan_.slot_of_unknown[i];
    const Vector6d information = weight * motion.prior_information[i];
    blocks_.poses[slot].diagonal() += information;
    blocks_.pose_gradient[slot] += information.cwiseProduct(state_.unknowns[i] - motion.prior[i]);
  }
  std::ranges::stable_sort(motion_blocks_, {}, &MotionBlock::column);
}

void SchurSolver::add_motion_column(std::uint32_t slot,
                                    std::span<const std::uint32_t> places,
                                    double* sums) const {
  constexpr std::size_t kSize = kBlockRows * kPaddedBlockRows;
  auto block = std::ranges::lower_bound(motion_blocks_, slot, {}, &MotionBlock::column);
  for (; block != motion_blocks_.end() && block->column == slot; ++block) {
    Eigen::Map<Eigen::Matrix<double, kPaddedBlockRows, 6>>(sums + kSize * places[block->row])
        .topRows<6>() += block->value;
  }
}

}  // namespace waymark

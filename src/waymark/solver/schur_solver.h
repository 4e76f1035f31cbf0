// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "waymark/solver/block_cholesky.h"
#include "waymark/solver/bundle_problem.h"

namespace waymark {

/// One round of bundle adjustment. Costs are half the robust sum over the used observations.
struct BundleRound {
  double initial_cost = 0.0;
  double final_cost = 0.0;
  int num_iterations = 0;
};

/// Levenberg-Marquardt that eliminates the points one by one (Schur complement; Triggs et al.
/// 2000, 6.1; Lourakis & Argyros 2009) and solves the reduced system of the free poses by a sparse
/// Cholesky decomposition. Robust by iteratively reweighted least squares. All sums run in a fixed
/// order: the same input gives the same bits, with any number of threads. Time is linear in the
/// observations and, along a way, in the free poses; cubic in those that see the same.
BundleRound minimize_with_schur(BundleProblem& problem,
                                std::span<const std::uint8_t> is_used,
                                const BundleOptions& options);

inline constexpr std::uint32_t kNoSlot = UINT32_MAX;

/// Which observations meet where. A link is a point together with a free pose that sees it, by
/// one camera or more; links run by point, then by pose.
struct SchurStructure {
  std::vector<std::uint32_t> slot_of_pose;     // Position in the reduced system, or kNoSlot.
  std::vector<std::uint32_t> slot_of_unknown;  // The same of those of BundleMotion.
  std::size_t num_slots = 0;
  // Slots that see a point or have a term in common. In an order of little fill-in.
  BlockPattern pattern;
  std::vector<std::uint32_t> observations;         // The used ones.
  std::vector<std::uint32_t> link_of_observation;  // Parallel to it; kNoSlot if none.
  std::vector<std::uint32_t> points;               // Those with observations.
  std::vector<std::uint32_t> first_observation;    // Per entry of points, and one past the end.
  std::vector<std::uint32_t> first_link;           // Likewise.
  std::vector<std::uint32_t> slot_of_link;
};

/// Of the poses, then of the unknowns of a term.
using SlotsOfTerm = std::array<std::uint32_t, BundleMotion::kNumBlocks>;
SlotsOfTerm slots_of(const BundleMotion::Term& term, const SchurStructure& plan);

SchurStructure make_schur_structure(const BundleProblem& problem,
                                    std::span<const std::uint8_t> is_used);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "waymark/optimize/bundle.h"

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
/// order, on the caller's thread: the same input gives the same bits. Time is linear in the
/// observations and, along a way, in the free poses; cubic in those that see the same.
BundleRound minimize_with_schur(BundleProblem& problem,
                                std::span<const std::uint8_t> is_used,
                                const BundleOptions& options);

}  // namespace waymark

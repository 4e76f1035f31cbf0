// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "waymark/solver/schur_solver.h"

namespace waymark::testing {

/// The same problem, loss and result as minimize_with_schur by Ceres: the independent opinion.
/// With one thread Ceres is repeatable, since blocks are contiguous.
BundleRound minimize_with_ceres(BundleProblem& problem,
                                std::span<const std::uint8_t> is_used,
                                const BundleOptions& options);

}  // namespace waymark::testing

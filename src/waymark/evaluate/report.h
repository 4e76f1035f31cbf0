// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "waymark/evaluate/evaluation.h"

namespace waymark {

/// For people: a few lines.
std::string format_evaluation(const Evaluation& evaluation);

/// For programs: one JSON object with pairs, poses, coverage, align, scale, path_length_m,
/// ate_rmse_m, ate_mean_m, ate_median_m, ate_max_m, ate_percent, rpe_m, rpe_deg and segments
/// (null, or t_percent, r_deg_per_100m and the same by_length).
std::string format_evaluation_json(const Evaluation& evaluation);

}  // namespace waymark

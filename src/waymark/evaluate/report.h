// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "waymark/evaluate/evaluation.h"

namespace waymark {

/// So many ns in seconds, to the tenth of a millisecond.
std::string format_offset(std::int64_t offset_ns);

/// For people: a few lines.
std::string format_evaluation(const Evaluation& evaluation);

/// For programs: one JSON object with pairs, poses, coverage, align, time_offset_s, scale,
/// path_length_m, ate_rmse_m, ate_mean_m, ate_median_m, ate_max_m, ate_percent, rpe_m, rpe_deg and
/// segments (null, or t_percent, r_deg_per_100m and the same by_length), and the notes.
std::string format_evaluation_json(const Evaluation& evaluation,
                                   std::span<const std::string> notes = {});

/// An SVG image (1000 x 460 px): left both trajectories in the coordinate plane of their largest
/// extent, to one scale, right the position error over time. Long trajectories are thinned out.
/// The trajectories are those that were evaluated; title is free text.
std::string plot_evaluation(const Evaluation& evaluation,
                            std::span<const StampedPose> estimate,
                            std::span<const StampedPose> groundtruth,
                            std::string_view title);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "waymark/evaluate/evaluation.h"

namespace waymark {

/// An SVG image (1000 x 460 px): left both trajectories in the coordinate plane of their largest
/// extent, to one scale, right the position error over time. Long trajectories are thinned out.
/// The trajectories are those that were evaluated; title is free text.
std::string plot_evaluation(const Evaluation& evaluation,
                            std::span<const StampedPose> estimate,
                            std::span<const StampedPose> groundtruth,
                            std::string_view title);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "waymark/results/trajectory.h"

namespace waymark {

/// Indices of an estimated pose and of the true pose nearest to it in time.
struct TimeMatch {
  std::size_t estimate = 0;
  std::size_t groundtruth = 0;
};

/// Pairs each estimated pose with the nearest true one, if that is at most max_difference_ns away.
/// Both must be sorted by time. Of two equally near the later one is taken; a true pose may serve
/// several estimated ones.
std::vector<TimeMatch> match_by_time(std::span<const StampedPose> estimate,
                                     std::span<const StampedPose> groundtruth,
                                     std::int64_t max_difference_ns);

/// Part of the time of the ground truth, 0 to 1, that the estimate covers: the sum of the intervals
/// between successive estimated poses, less those longer than 3 median intervals.
double covered_part(std::span<const StampedPose> estimate,
                    std::span<const StampedPose> groundtruth);

/// Median time between successive poses, 0 for fewer than 2.
std::int64_t median_interval_ns(std::span<const StampedPose> poses);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "waymark/results/trajectory.h"

namespace waymark {

/// How much later the clock of the estimate has to be for its speeds to be those of the ground
/// truth, in ns: where the correlation of the speed and of the rate of turning, which know neither
/// frame nor scale, is largest. Both sorted by time. Nothing where the speeds do not tell: too few
/// poses, too even a motion, or no shift at which they agree over half of the shorter one.
std::optional<std::int64_t> find_time_offset(std::span<const StampedPose> estimate,
                                             std::span<const StampedPose> groundtruth);

/// A time that is moved; it stays within 64 bits.
std::int64_t moved_time(std::int64_t timestamp_ns, std::int64_t offset_ns);

}  // namespace waymark

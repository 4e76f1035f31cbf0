// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/results/results.h"

namespace waymark {

/// How well what a session made agrees with itself. Frames are those of the input, trajectories
/// those of the sub-maps.
RunQuality assess(const Map& map,
                  std::span<const FrameRecord> frames,
                  std::span<const std::vector<StampedPose>> trajectories);

/// The same in words, in one line.
std::string describe(const RunQuality& quality, std::size_t num_loops);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
#include <vector>

#include "waymark/system/system.h"

namespace waymark::python {

/// The frames that have a pose, in order.
struct Trajectory {
  std::vector<TrajectoryFrame> frames;

  Trajectory of_submap(std::uint32_t submap) const {
    Trajectory part;
    std::copy_if(frames.begin(),
                 frames.end(),
                 std::back_inserter(part.frames),
                 [&](const TrajectoryFrame& frame) { return frame.submap.value == submap; });
    return part;
  }

  /// Of the sub-map with most frames, of equal ones the older.
  Trajectory largest() const {
    std::map<std::uint32_t, std::size_t> counts;
    for (const TrajectoryFrame& frame : frames) ++counts[frame.submap.value];
    const auto most =
        std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) {
          return a.second < b.second;
        });
    return most == counts.end() ? Trajectory{} : of_submap(most->first);
  }
};

}  // namespace waymark::python

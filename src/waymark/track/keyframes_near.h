// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "waymark/camera/rig.h"
#include "waymark/map/map.h"

namespace waymark {

/// The keyframes of a sub-map that a rig at about this pose is likeliest to share landmarks with,
/// the likeliest first. rig: the one that looks; the map may be of other cameras.
std::vector<KeyframeId> keyframes_near(const Map& map,
                                       SubmapId submap,
                                       const Rig& rig,
                                       const Rigid3& rig_from_world,
                                       std::size_t max_count);

}  // namespace waymark

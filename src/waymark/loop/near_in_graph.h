// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "waymark/map/map.h"

namespace waymark {

/// Keyframes that share so many landmarks are linked in the covisibility graph.
inline constexpr std::uint32_t kMinSharedOfLinked = 15;

/// The keyframe and those so many steps away from it, by covisibility or up the spanning tree;
/// ascending.
std::vector<KeyframeId> within_steps(const Map& map, KeyframeId keyframe, int num_steps);

}  // namespace waymark

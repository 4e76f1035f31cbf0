// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "waymark/map/map.h"

namespace waymark {

/// The landmarks on what is gone: several keyframes later than all that see one look at its place
/// from where it was known, and what they see around it lies clearly beyond. Ascending.
///
/// What hides a surface tells nothing, nor does a landmark that was only missed: around that there
/// is something as far away as it. Only keyframes that see the same surroundings are asked, so that
/// the work grows with the map and not with its square.
std::vector<LandmarkId> find_seen_through(const Map& map);

}  // namespace waymark

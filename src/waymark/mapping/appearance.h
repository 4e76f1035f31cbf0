// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/map/map.h"

namespace waymark {

/// What a landmark looks like, from its observations: the descriptor with the least median
/// distance to the others, the mean direction towards its observers, and the metric size of a
/// pixel at its reference.
Appearance describe_landmark(const Map& map, LandmarkId id);

}  // namespace waymark

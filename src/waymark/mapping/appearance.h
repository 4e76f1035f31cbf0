// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/map/map.h"

namespace waymark {

/// What a landmark looks like, from its observations: as in the newest of them, since the next view
/// is most like it; the mean direction towards its observers; and the metric size of a pixel at its
/// reference.
Appearance describe_landmark(const Map& map, LandmarkId id);

}  // namespace waymark

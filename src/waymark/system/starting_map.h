// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/map/map.h"

namespace waymark {

/// The id after those of all frames of a map, which may be null. Throws InputError where none is
/// left.
FrameId frame_after(const Map* map);

/// Throws InputError for a map that cannot take ranges in metres.
void check_has_scale(const Map& map);

/// Throws InputError for a map with a camera of an unknown model: mapping looks through all of
/// them.
void check_cameras(const Map& map);

}  // namespace waymark

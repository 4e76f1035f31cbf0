// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "waymark/atlas/atlas_localizer.h"
#include "waymark/session/session.h"

namespace waymark {

/// Finds all frames of an input in an atlas, as localize_input() does in a map. The trajectories
/// are in the frames of its parts. Keyframes and landmarks are counted, but not among the results:
/// that would open all tiles.
SessionResults localize_in_atlas(Input& input,
                                 AtlasLocalizer& localizer,
                                 ImageOrder order,
                                 const std::function<bool()>& should_stop,
                                 const FrameObserver& observer);

}  // namespace waymark

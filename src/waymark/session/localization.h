// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "waymark/input/input.h"
#include "waymark/map/map.h"
#include "waymark/session/session.h"
#include "waymark/system/localizer.h"

namespace waymark {

/// Whether images follow each other or have nothing to do with each other.
enum class ImageOrder { kStream, kUnordered };

/// Finds all frames of an input in the map of a localizer until it ends or should_stop() says so.
/// The trajectories are in the map's frames, keyframes and counts those of the map. setup, timing,
/// seed and version of the summary are left to the caller.
SessionResults localize_input(Input& input,
                              Localizer& localizer,
                              ImageOrder order,
                              const std::function<bool()>& should_stop,
                              const FrameObserver& observer);

}  // namespace waymark

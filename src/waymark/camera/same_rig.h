// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/camera/rig.h"

namespace waymark {

/// Whether two rigs have the same cameras at the same places, by their descriptions; a camera
/// without one is the same as itself alone.
bool is_same_rig(const Rig& a, const Rig& b);

}  // namespace waymark

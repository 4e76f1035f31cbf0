// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "waymark/camera/camera.h"
#include "waymark/image/features.h"
#include "waymark/match/appearance.h"

namespace waymark {

/// Whether the camera stood still between two frames, whatever moved before it: all over the image
/// features stay where they were to a pixel. A camera that moves has such features as well, but not
/// all over: what is far away or straight ahead, what moves along, text that is burnt in. One that
/// shows all directions may show what carries it in half of its image or more.
bool is_at_rest(const Camera& camera,
                const Features& before,
                const Features& now,
                std::span<const FeatureMatch> matches);

}  // namespace waymark

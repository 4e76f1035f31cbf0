// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "waymark/camera/rig.h"
#include "waymark/map/map.h"

namespace waymark {

/// How well a pose explains what features show, 0 to 1: the part that is found of those landmarks
/// of a keyframe nearby that should be seen, times the part of them that lies where at least some
/// others are found, too. Where things look alike, a wrong pose explains some regions of the image
/// well and others not at all; a change of light thins all of them. No more is expected than there
/// are features where the keyframe shows something.
/// landmarks: per feature the landmark that it shows at this pose.
double place_confidence(const Features& features,
                        std::span<const LandmarkId> landmarks,
                        const Map& map,
                        KeyframeId nearby,
                        const Rigid3& rig_from_world);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "waymark/mapping/associate.h"
#include "waymark/mapping/options.h"
#include "waymark/match/epipolar.h"

namespace waymark {

/// Makes landmarks of features that a keyframe shares with its covisible keyframes but that no
/// landmark explains yet. Returns them.
std::vector<LandmarkId> triangulate_with_neighbours(Map& map,
                                                    KeyframeId keyframe,
                                                    EpipolarMatcher& matcher,
                                                    DirtyLandmarks& dirty,
                                                    const TriangulationOptions& options = {});

}  // namespace waymark

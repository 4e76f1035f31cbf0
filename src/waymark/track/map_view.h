// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/optimize/pose.h"
#include "waymark/track/messages.h"

namespace waymark {

/// What a frame saw of the map: enough to locate it once more when the map has become better.
struct MapView {
  std::vector<LandmarkId> landmarks;
  PoseObservations observations;  ///< Parallel to landmarks; their points are not used.

  bool is_empty() const { return landmarks.empty(); }
};

/// Of a frame and the landmark of each of its features, invalid where it has none.
MapView view_of(const Features& features, std::span<const LandmarkId> landmarks);

/// The pose of a frame in the map as it is now, starting from the pose it had. Nothing if less than
/// half of what it saw is left or fits.
std::optional<RelativePose> locate_again(const MapView& view,
                                         const Map& map,
                                         const Rig& rig,
                                         const RelativePose& pose,
                                         PoseWorkspace& workspace);

}  // namespace waymark

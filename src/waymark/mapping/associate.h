// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <set>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/map/messages.h"

namespace waymark {

/// Squared residual, in pixels of the feature's level, of a world point in a feature of a keyframe;
/// nothing if it lies behind the bearing. Above kMaxSquaredResidual it is not the same point.
std::optional<double> squared_residual(const Keyframe& keyframe,
                                       std::uint32_t feature,
                                       const Eigen::Vector3d& point_in_world);
inline constexpr double kMaxSquaredResidual = 5.991;  ///< 95 % of chi-square, 2 degrees of freedom.

/// Whether a point fits a feature.
bool agrees(const Keyframe& keyframe, std::uint32_t feature, const Eigen::Vector3d& point_in_world);

/// Landmarks changed since their appearance was last computed, in order.
using DirtyLandmarks = std::set<LandmarkId>;

/// Landmarks for the features of a keyframe that have a reliable range and no landmark yet.
/// Returns how many.
int add_landmarks_from_range(Map& map, KeyframeId keyframe, DirtyLandmarks& dirty);

}  // namespace waymark

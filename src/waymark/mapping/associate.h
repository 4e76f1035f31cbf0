// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <set>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/track/messages.h"

namespace waymark {

/// Squared residual of a world point in a feature of a keyframe, in units of its standard
/// deviation: one pixel of the feature's level, and what the covariance of the point (m^2, world
/// axes) makes of it there. Nothing if the point lies behind the bearing. Above kMaxSquaredResidual
/// it is not the same point.
std::optional<double> squared_residual(const Keyframe& keyframe,
                                       std::uint32_t feature,
                                       const Eigen::Vector3d& point_in_world,
                                       const Eigen::Matrix3d& covariance = Eigen::Matrix3d::Zero());
inline constexpr double kMaxSquaredResidual = 5.991;  ///< 95 % of chi-square, 2 degrees of freedom.

/// Whether a point fits a feature.
bool agrees(const Keyframe& keyframe,
            std::uint32_t feature,
            const Eigen::Vector3d& point_in_world,
            const Eigen::Matrix3d& covariance = Eigen::Matrix3d::Zero());

/// What its observations tell of the position of a landmark, as the inverse of a covariance (1/m^2,
/// world axes), the keyframes taken as known. Before any, a standard deviation of the distance.
Eigen::Matrix3d position_information(const Map& map, const Landmark& landmark);

/// Associates a primary feature with a landmark, and its partner where that agrees.
void observe_with_partner(Map& map,
                          KeyframeId keyframe,
                          std::uint32_t feature,
                          LandmarkId landmark);

/// Removes an observation; that of a primary feature takes its partner's with it.
void forget_with_partner(Map& map, KeyframeId keyframe, std::uint32_t feature);

/// Landmarks changed since their appearance was last computed, in order.
using DirtyLandmarks = std::set<LandmarkId>;

/// Landmarks for the features of a keyframe that have a reliable range and no landmark yet.
/// Returns how many.
int add_landmarks_from_range(Map& map, KeyframeId keyframe, DirtyLandmarks& dirty);

}  // namespace waymark

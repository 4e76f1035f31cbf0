// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "waymark/map/align.h"
#include "waymark/map/map.h"
#include "waymark/results/trajectory.h"

namespace waymark {

/// A map in another frame or other units, and what became of each sub-map, a line each.
struct AlignedMap {
  Map map;
  std::vector<std::string> report;
};

/// Scales the sub-map of some keyframes or landmarks, whose scale must be free, by how far apart
/// they are. InputError, which names `where`, for those that are not there or not of one sub-map
/// and for distances or factors beyond what is possible (1 000 km; 1e-6 to 1e6).
AlignedMap align_to_distances(const Map& map,
                              std::span<const KnownDistance> distances,
                              const std::string& where);

/// Puts each sub-map where a trajectory of camera 0 has its keyframes, within 20 ms (see
/// fit_submaps()). InputError, which names `where`, if it has none of them, or poses or factors
/// beyond what is possible.
AlignedMap align_to_trajectory(const Map& map,
                               std::span<const StampedPose> trajectory,
                               const std::string& where);

/// Turns the largest sub-map so that a direction in it is +z. InputError, which names `where`, for
/// a direction that is none and a map without keyframes.
AlignedMap align_upright(const Map& map, const Eigen::Vector3d& up, const std::string& where);

}  // namespace waymark

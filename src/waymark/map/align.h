// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "waymark/geometry/alignment.h"
#include "waymark/map/map.h"

namespace waymark {

/// Puts all of a sub-map, which must be a part of its own with keyframes, into another frame and
/// other units. What is stored relative to its keyframes follows.
void transform_submap(Map& map, SubmapId submap, const Sim3& new_from_old);

/// Whether keyframes of a sub-map know distances, from stereo or depth. A sub-map that does not can
/// be scaled without contradicting what was measured.
bool has_measured_ranges(const Map& map, SubmapId submap);

/// The same map, the lengths of a sub-map (and of all that was joined into it) being metres.
Map declare_metric(const Map& map, SubmapId submap);

/// A sub-map brought into a frame in metres: moved, and metric from then on.
Map put_into_metres(Map map, SubmapId submap, const Sim3& new_from_old);

/// Where camera 0 of a keyframe is, in the world.
Eigen::Vector3d camera_position(const Keyframe& keyframe);

/// A place in the map: camera 0 of a keyframe, or a landmark.
using MapPlace = std::variant<KeyframeId, LandmarkId>;

/// How far apart two places really are.
struct KnownDistance {
  MapPlace a;     ///< One of them.
  MapPlace b;     ///< The other one.
  double metres;  ///< Between them.
};

/// Metres per unit of the map, such that the squared errors in metres are least in sum. Nothing if
/// all are where the map has no distance. The places must be there.
std::optional<double> scale_by_distances(const Map& map, std::span<const KnownDistance> known);

/// The shortest turn after which a direction is +z.
Eigen::Quaterniond turn_upright(const Eigen::Vector3d& up);

/// How a sub-map fits a trajectory.
struct TrajectoryFit {
  Sim3 trajectory_from_map;       ///< Of the frames of both.
  std::size_t num_keyframes = 0;  ///< With a pose of the trajectory at their time.
  double rms_m = 0.0;             ///< Of their positions.
};

/// The similarity, or rigid motion, that puts camera 0 of a sub-map's keyframes where a trajectory
/// of that camera has it at their times (Umeyama 1991). Nothing where fewer than three keyframes
/// have a pose at most max_difference_ns away, or all are on a line.
std::optional<TrajectoryFit> fit_trajectory(const Map& map,
                                            SubmapId submap,
                                            const TimedPoses& trajectory,
                                            std::int64_t max_difference_ns,
                                            bool is_scale_free);

/// Fits each sub-map that is a part of its own, the largest first, and moves those that fit; the
/// scale is free where nothing measured it. Gives each with its fit, if there is one.
std::vector<std::pair<SubmapId, std::optional<TrajectoryFit>>> fit_submaps(
    Map& map, const TimedPoses& trajectory, std::int64_t max_difference_ns);

}  // namespace waymark

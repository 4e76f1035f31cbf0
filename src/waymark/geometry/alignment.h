// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "waymark/geometry/rigid3.h"
#include "waymark/geometry/sim3.h"

namespace waymark {

/// The rotation b_from_a that minimises the weighted squared distances of b_i from R a_i, for
/// directions or centred points. Empty weights mean one each; weights must not be negative.
/// Nothing unless the directions determine it, which takes two that are not parallel
/// (Umeyama 1991, lemma; the rotation never becomes a reflection).
std::optional<Eigen::Matrix3d> align_directions(std::span<const Eigen::Vector3d> directions_a,
                                                std::span<const Eigen::Vector3d> directions_b,
                                                std::span<const double> weights = {});

/// The rigid motion or similarity b_from_a that minimises the weighted squared distances of
/// points_b from b_from_a * points_a (Umeyama 1991, eq. 40-42). The arrays run in parallel. Nothing
/// unless the points determine it: three that are not on a line. Points on a plane do.
std::optional<Rigid3> align_rigid(std::span<const Eigen::Vector3d> points_a,
                                  std::span<const Eigen::Vector3d> points_b,
                                  std::span<const double> weights = {});
/// The same with a scale.
std::optional<Sim3> align_similarity(std::span<const Eigen::Vector3d> points_a,
                                     std::span<const Eigen::Vector3d> points_b,
                                     std::span<const double> weights = {});

/// A trajectory to be aligned: world_from_rig poses in the order of their strictly ascending times.
struct TimedPoses {
  std::span<const std::int64_t> timestamps_ns;  ///< Ascending.
  std::span<const Rigid3> world_from_rig;       ///< One per time.
};

/// Indices of two poses that belong together.
struct PosePair {
  std::uint32_t a;  ///< Of the first trajectory.
  std::uint32_t b;  ///< Of the second one.
};
/// Each pose of a with the nearest in time of b if that is at most max_difference_ns away, each
/// pose of b used once at most (for the nearest).
std::vector<PosePair> associate(std::span<const std::int64_t> timestamps_a_ns,
                                std::span<const std::int64_t> timestamps_b_ns,
                                std::int64_t max_difference_ns);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/camera/rig.h"
#include "waymark/features/features.h"
#include "waymark/simulate/world.h"

namespace waymark {

/// A point that can be seen: a corner of a size, with a look of its own.
struct PointLandmark {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();    ///< Outward; zero: seen from all sides.
  Eigen::Vector3d tangent = Eigen::Vector3d::UnitX();  ///< Unit; gives the feature's orientation.
  Descriptor descriptor{};
  /// Size in metres of what covers one pixel of its level: level and size_rad follow from distance.
  double size_m = 0.01;
  double response = 0.0;  ///< The strongest are kept where there are too many.
};

/// Landmarks, and what may hide them.
struct PointCloud {
  std::vector<PointLandmark> landmarks;
  std::shared_ptr<const World> world;  ///< Null: nothing hides them.
};

/// Landmarks on the surfaces of a world, as dense everywhere, for views from about distance_m away:
/// sizes suit distances of a quarter to four times that.
PointCloud scatter_on(std::shared_ptr<const World> world,
                      int count,
                      double distance_m,
                      std::uint64_t seed);

/// Landmarks in a box, seen from all sides.
PointCloud scatter_in(const Eigen::Vector3d& min,
                      const Eigen::Vector3d& max,
                      int count,
                      double distance_m,
                      std::uint64_t seed);

/// How features differ from the truth.
struct PointNoise {
  std::uint64_t seed = 0;
  /// Per axis, in pixels of the feature's level; in camera 1 half as much besides that of camera 0.
  double pixel_sigma = 0.5;
  double flip_probability = 0.04;    ///< Of each bit of a descriptor.
  double miss_probability = 0.1;     ///< Of a visible landmark.
  double outlier_share = 0.0;        ///< Features at random places with the looks of landmarks.
  double inverse_range_sigma = 0.0;  ///< In 1/m; above 0 the rig measures range (RGB-D).
  int max_features = 1000;
};

inline constexpr std::uint32_t kNoLandmark = UINT32_MAX;

struct PointObservation {
  std::shared_ptr<const Features> features;
  std::vector<std::uint32_t> landmark_of_feature;  ///< Index in the cloud; kNoLandmark: outlier.
};

/// What a rig would extract at a pose; complete Features, as from images. Of a rig with two cameras
/// landmarks that both see get a partner in camera 1 and a range. The result depends on (seed,
/// frame), never on earlier calls.
PointObservation observe(const PointCloud& cloud,
                         const std::shared_ptr<const Rig>& rig,
                         const Rigid3& world_from_rig,
                         const PointNoise& noise,
                         std::uint64_t frame);

}  // namespace waymark

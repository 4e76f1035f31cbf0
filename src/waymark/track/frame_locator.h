// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/optimize/pose.h"

namespace waymark {

/// The pose that follows from which landmark each feature of a frame shows.
struct LocatedFrame {
  Rigid3 rig_from_world;
  Matrix6d covariance = Matrix6d::Zero();
  int num_matches = 0;  ///< Primary features with a landmark before outliers were removed.
  int num_inliers = 0;  ///< Primary features with a landmark after.
};

/// Pose of a frame from the landmarks assigned to its features. Keeps its buffers.
class FrameLocator {
 public:
  explicit FrameLocator(std::shared_ptr<const Rig> rig) : rig_(std::move(rig)) {}

  /// landmarks: per feature; on entry primary features have candidates (living in the map), on
  /// return outliers are cleared and partner features of inliers that agree are set.
  LocatedFrame locate(const Features& features,
                      const Map& map,
                      const Rigid3& initial_rig_from_world,
                      std::vector<LandmarkId>& landmarks);

 private:
  void collect(const Features& features, const Map& map, const std::vector<LandmarkId>& landmarks);

  std::shared_ptr<const Rig> rig_;
  PoseObservations observations_;
  std::vector<std::uint32_t> feature_of_observation_;
  PoseWorkspace workspace_;
};

}  // namespace waymark

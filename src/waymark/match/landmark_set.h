// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "waymark/map/map.h"

namespace waymark {

/// Landmarks to look for in an image, as parallel arrays.
struct LandmarkSet {
  std::vector<LandmarkId> ids;
  std::vector<Eigen::Vector3d> positions_in_world;
  std::vector<Eigen::Vector3d> directions;  ///< See Appearance.
  std::vector<double> sizes_m;              ///< See Appearance.
  std::vector<Descriptor> descriptors;
  std::vector<Eigen::Vector3d> across;  ///< See Appearance.

  std::size_t size() const { return ids.size(); }

  void clear() {
    ids.clear();
    positions_in_world.clear();
    directions.clear();
    sizes_m.clear();
    descriptors.clear();
    across.clear();
  }

  void add(LandmarkId id, const Landmark& landmark) {
    ids.push_back(id);
    positions_in_world.push_back(landmark.position_in_world);
    directions.push_back(landmark.appearance.direction);
    sizes_m.push_back(landmark.appearance.size_m);
    descriptors.push_back(landmark.appearance.descriptor);
    across.push_back(landmark.appearance.across);
  }
};

}  // namespace waymark

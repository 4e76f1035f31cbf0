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

  /// Drops points on edges, which look alike: by them no place is known.
  void keep_corners() {
    std::size_t num_kept = 0;
    for (std::size_t i = 0; i < size(); ++i) {
      if (!across[i].isZero()) continue;
      ids[num_kept] = ids[i];
      positions_in_world[num_kept] = positions_in_world[i];
      directions[num_kept] = directions[i];
      sizes_m[num_kept] = sizes_m[i];
      descriptors[num_kept] = descriptors[i];
      across[num_kept++] = across[i];
    }
    ids.resize(num_kept);
    positions_in_world.resize(num_kept);
    directions.resize(num_kept);
    sizes_m.resize(num_kept);
    descriptors.resize(num_kept);
    across.resize(num_kept);
  }
};

}  // namespace waymark

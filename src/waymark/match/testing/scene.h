// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "waymark/camera/perspective.h"
#include "waymark/match/landmark_set.h"
#include "waymark/simulate/testing/points.h"

namespace waymark {

/// One perspective camera, or two of them 0.12 m apart.
inline std::shared_ptr<const Rig> make_test_rig(int num_cameras) {
  const auto camera = std::make_shared<PerspectiveCamera>(
      PerspectiveModel({420.0, 420.0}, {319.5, 239.5}), 640, 480);
  Rig rig;
  rig.cameras.push_back({camera, Rigid3()});
  const Rigid3 beside(Eigen::Quaterniond::Identity(), {-0.12, 0.0, 0.0});
  if (num_cameras > 1) rig.cameras.push_back({camera, beside});
  return std::make_shared<const Rig>(std::move(rig));
}

inline Rigid3 make_test_pose(const Eigen::Vector3d& position, const Eigen::Vector3d& turn_rad) {
  const Rigid3 turned = Rigid3::exp((Vector6d() << Eigen::Vector3d::Zero(), turn_rad).finished());
  return {turned.rotation, position};
}

/// A cloud and the points of a box that moves before it.
inline PointCloud with_box(PointCloud cloud, const PointCloud& box, const Rigid3& world_from_box) {
  for (PointLandmark corner : box.landmarks) {
    corner.position = world_from_box * corner.position;
    cloud.landmarks.push_back(corner);
  }
  return cloud;
}

/// The landmarks of a cloud as seen from an eye; ids are indices in the cloud.
inline LandmarkSet true_landmarks(const PointCloud& cloud, const Eigen::Vector3d& eye) {
  LandmarkSet set;
  for (std::size_t i = 0; i < cloud.landmarks.size(); ++i) {
    const PointLandmark& point = cloud.landmarks[i];
    Landmark landmark;
    landmark.position_in_world = point.position;
    landmark.appearance = {point.descriptor, (eye - point.position).normalized(), point.size_m};
    set.add(LandmarkId{static_cast<std::uint32_t>(i)}, landmark);
  }
  return set;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/frame_locator.h"

namespace waymark {

LocatedFrame FrameLocator::locate(const Features& features,
                                  const Map& map,
                                  const Rigid3& initial_rig_from_world,
                                  std::vector<LandmarkId>& landmarks) {
  collect(features, map, landmarks);
  const PoseEstimate estimate =
      optimize_pose(*rig_, observations_, initial_rig_from_world, PoseOptions{}, workspace_);
  LocatedFrame located;
  located.rig_from_world = estimate.rig_from_world;
  located.covariance = estimate.covariance;
  for (std::size_t k = 0; k < feature_of_observation_.size(); ++k) {
    const std::uint32_t feature = feature_of_observation_[k];
    if (feature < features.num_primary) {
      ++located.num_matches;
      located.num_inliers += estimate.is_inlier[k];
      if (!estimate.is_inlier[k]) landmarks[feature] = LandmarkId{};
    } else {
      const LandmarkId of_primary = landmarks[features.partner[feature]];
      landmarks[feature] = estimate.is_inlier[k] ? of_primary : LandmarkId{};
    }
  }
  return located;
}

void FrameLocator::collect(const Features& features,
                           const Map& map,
                           const std::vector<LandmarkId>& landmarks) {
  observations_.clear();
  feature_of_observation_.clear();
  for (std::uint32_t feature = 0; feature < features.num_primary; ++feature) {
    if (!landmarks[feature].is_valid()) continue;
    const Eigen::Vector3d& position = map.landmarks().at(landmarks[feature]).position_in_world;
    for (const std::uint32_t seer : {feature, features.partner[feature]}) {
      if (seer == kNoFeature) continue;
      observations_.add(position, features.measurement(seer));
      feature_of_observation_.push_back(seer);
    }
  }
}

}  // namespace waymark

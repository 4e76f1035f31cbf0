// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/frame_locator.h"

#include <algorithm>
#include <utility>

namespace waymark {
namespace {

std::vector<LandmarkId> visible_of(const LandmarkSet& set, const ProjectionMatches& matches) {
  std::vector<LandmarkId> visible;
  for (std::size_t i = 0; i < set.size(); ++i) {
    if (matches.is_visible[i]) visible.push_back(set.ids[i]);
  }
  return visible;
}

}  // namespace

void set_located(const LocatedFrame& located, TrackingResult& result) {
  result.state = FrameState::kTracked;
  result.world_from_rig = located.rig_from_world.inverse();
  result.covariance = located.covariance;
  result.num_matches = located.num_matches;
  result.num_inliers = located.num_inliers;
}

int num_valid(std::span<const LandmarkId> landmarks) {
  return static_cast<int>(std::ranges::count_if(landmarks, &LandmarkId::is_valid));
}

std::vector<LandmarkId> primary_landmarks(const Features& features,
                                          std::span<const LandmarkId> landmarks) {
  std::vector<LandmarkId> shown;
  for (std::size_t i = 0; i < features.num_primary; ++i) {
    if (landmarks[i].is_valid()) shown.push_back(landmarks[i]);
  }
  return shown;
}

LocatedFrame FrameLocator::locate(const Features& features,
                                  const Map& map,
                                  const Rigid3& initial_rig_from_world,
                                  std::vector<LandmarkId> landmarks) {
  collect(features, map, landmarks);
  const PoseEstimate estimate =
      optimize_pose(*features.rig, observations_, initial_rig_from_world, workspace_);
  LocatedFrame located;
  located.rig_from_world = estimate.rig_from_world;
  located.covariance = estimate.covariance;
  for (std::size_t k = 0; k < feature_of_observation_.size(); ++k) {
    ++located.num_matches;
    located.num_inliers += estimate.is_inlier[k];
    if (!estimate.is_inlier[k]) landmarks[feature_of_observation_[k]] = LandmarkId{};
  }
  located.landmarks = std::move(landmarks);
  return located;
}

std::vector<LandmarkId> FrameLocator::find(const Features& features,
                                           const LandmarkSet& set,
                                           const Rigid3& rig_from_world,
                                           const ProjectionOptions& options,
                                           std::vector<LandmarkId>* visible) {
  const ProjectionMatches& matches =
      matcher_.match(*features.rig, set, features, {}, rig_from_world, options);
  if (visible) *visible = visible_of(set, matches);
  std::vector<LandmarkId> landmarks(features.size());
  for (std::size_t i = 0; i < set.size(); ++i) {
    if (matches.features[i] != kNoFeature) landmarks[matches.features[i]] = set.ids[i];
  }
  return landmarks;
}

std::vector<LandmarkId> FrameLocator::find_alike(const Features& features,
                                                 const Keyframe& keyframe) {
  std::vector<std::uint32_t> with_landmark;
  for (std::uint32_t i = 0; i < keyframe.features->num_primary; ++i) {
    if (keyframe.landmarks[i].is_valid()) with_landmark.push_back(i);
  }
  std::vector<LandmarkId> landmarks(features.size());
  for (const FeatureMatch& match : appearance_.match_all(
           *keyframe.features, with_landmark, features, {.max_distance = 60, .max_ratio = 0.8})) {
    landmarks[match.b] = keyframe.landmarks[match.a];
  }
  return landmarks;
}

LocatedFrame FrameLocator::locate_again(const Features& features,
                                        const Map& map,
                                        LocatedFrame first,
                                        const LandmarkSet& set,
                                        const ProjectionOptions& options) {
  // The nearest edge is another one where the pose was off by as much.
  for (std::size_t i = features.num_corners(); i < features.num_primary; ++i) {
    first.landmarks[i] = LandmarkId{};
  }
  is_taken_.resize(features.num_primary);
  for (std::size_t i = 0; i < is_taken_.size(); ++i) is_taken_[i] = first.landmarks[i].is_valid();
  std::vector<LandmarkId> found = primary_landmarks(features, first.landmarks);
  std::ranges::sort(found);
  const ProjectionMatches& matches =
      matcher_.match(*features.rig, set, features, is_taken_, first.rig_from_world, options);
  for (std::size_t i = 0; i < set.size(); ++i) {
    if (matches.features[i] == kNoFeature) continue;
    if (std::ranges::binary_search(found, set.ids[i])) continue;
    first.landmarks[matches.features[i]] = set.ids[i];
  }
  LocatedFrame located = locate(features, map, first.rig_from_world, std::move(first.landmarks));
  located.visible = visible_of(set, matches);
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
    observations_.add(position, features.measurement(feature));
    feature_of_observation_.push_back(feature);
  }
}

}  // namespace waymark

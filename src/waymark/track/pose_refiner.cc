// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/pose_refiner.h"

namespace waymark {
namespace {

/// Below this a pose is not safer than the one it would replace.
constexpr std::size_t kMinObservations = 20;
constexpr double kMinInlierRatio = 0.5;
/// A start's poses are off by what little parallax it had.
constexpr double kRefineRadiusPx = 20.0;

}  // namespace

std::vector<SeenLandmark> seen_landmarks(const Features& features,
                                         std::span<const LandmarkId> landmarks) {
  std::vector<SeenLandmark> seen;
  for (std::uint32_t feature = 0; feature < landmarks.size(); ++feature) {
    if (!landmarks[feature].is_valid()) continue;
    seen.push_back({features.measurement(feature), landmarks[feature]});
  }
  return seen;
}

std::optional<Rigid3> PoseRefiner::refine(const Map& map,
                                          std::span<const SeenLandmark> seen,
                                          const Rigid3& rig_from_world) {
  observations_.clear();
  for (const SeenLandmark& one : seen) {
    const LandmarkId living = map.resolve(one.landmark);
    if (!living.is_valid()) continue;
    observations_.add(map.landmarks().at(living).position_in_world, one);
  }
  if (observations_.size() < kMinObservations) return std::nullopt;
  const PoseEstimate estimate =
      optimize_pose(*rig_, observations_, rig_from_world, PoseOptions{}, workspace_);
  if (estimate.num_inliers < kMinObservations ||
      static_cast<double>(estimate.num_inliers) <
          kMinInlierRatio * static_cast<double>(observations_.size())) {
    return std::nullopt;
  }
  return estimate.rig_from_world;
}

std::vector<SeenLandmark> PoseRefiner::find(const Map& map,
                                            KeyframeId keyframe,
                                            const Features& features,
                                            const Rigid3& rig_from_world) {
  LandmarkSet set;
  for (LandmarkId id : map.keyframes().at(map.resolve(keyframe)).landmarks) {
    if (id.is_valid()) set.add(id, map.landmarks().at(id));
  }
  const ProjectionMatches& matches =
      matcher_.match(set, features, {}, rig_from_world, {.radius_px = kRefineRadiusPx});
  std::vector<SeenLandmark> seen;
  for (std::size_t i = 0; i < set.size(); ++i) {
    if (matches.features[i] == kNoFeature) continue;
    seen.push_back({features.measurement(matches.features[i]), set.ids[i]});
  }
  return seen;
}

}  // namespace waymark

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

SeenLandmark seen_by(const Features& features, std::uint32_t feature, LandmarkId landmark) {
  SeenLandmark seen;
  seen.landmark = landmark;
  seen.bearing = features.bearings[feature];
  seen.level_pixel_from_bearing = features.level_pixel_from_bearing[feature];
  seen.camera = features.keypoints[feature].camera;
  const MeasuredRange measured = features.measured_range(feature);
  seen.inverse_range = measured.inverse;
  seen.inverse_range_sigma = measured.inverse_sigma;
  return seen;
}

}  // namespace

std::vector<SeenLandmark> seen_landmarks(const Features& features,
                                         std::span<const LandmarkId> landmarks) {
  std::vector<SeenLandmark> seen;
  for (std::uint32_t feature = 0; feature < landmarks.size(); ++feature) {
    if (landmarks[feature].is_valid())
      seen.push_back(seen_by(features, feature, landmarks[feature]));
  }
  return seen;
}

PoseRefiner::PoseRefiner(std::shared_ptr<const Rig> rig) : rig_(rig), matcher_(rig) {}

std::optional<Rigid3> PoseRefiner::refine(const Map& map,
                                          std::span<const SeenLandmark> seen,
                                          const Rigid3& rig_from_world) {
  observations_.clear();
  for (const SeenLandmark& one : seen) {
    const LandmarkId living = map.resolve(one.landmark);
    if (!living.is_valid()) continue;
    observations_.point_in_world.push_back(map.landmarks().at(living).position_in_world);
    observations_.bearing.push_back(one.bearing);
    observations_.level_pixel_from_bearing.push_back(one.level_pixel_from_bearing);
    observations_.camera.push_back(one.camera);
    observations_.inverse_range.push_back(one.inverse_range);
    observations_.inverse_range_sigma.push_back(one.inverse_range_sigma);
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
    seen.push_back(seen_by(features, matches.features[i], set.ids[i]));
  }
  return seen;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/pose_refiner.h"

#include <cmath>

#include "waymark/features/pyramid.h"
#include "waymark/features/rolling_shutter.h"

namespace waymark {
namespace {

/// Below this a pose is not safer than the one it would replace.
constexpr std::size_t kMinObservations = 20;
constexpr double kMinInlierRatio = 0.5;
/// A start's poses are off by what little parallax it had.
constexpr double kRefineRadiusPx = 20.0;
constexpr float kAcrossUnitRad = 1e-4f;

SeenLandmark see(const Features& features, std::uint32_t feature, LandmarkId landmark) {
  const Keypoint& keypoint = features.keypoints[feature];
  SeenLandmark seen{.landmark = landmark, .x_px = keypoint.x_px, .y_px = keypoint.y_px};
  seen.level = keypoint.level;
  seen.is_edge = features.is_edge(feature);
  if (seen.is_edge) {
    seen.across = static_cast<std::int16_t>(std::lround(keypoint.angle_rad / kAcrossUnitRad));
  }
  if (features.partner[feature] != kNoFeature) return seen;
  const Measurement measured = features.measurement(feature);
  if (measured.inverse_range_sigma == 0.0f) return seen;
  seen.inverse_depth = measured.inverse_range / measured.bearing.z();
  seen.inverse_depth_sigma = measured.inverse_range_sigma / measured.bearing.z();
  return seen;
}

}  // namespace

std::vector<SeenLandmark> seen_landmarks(const Features& features,
                                         std::span<const LandmarkId> landmarks) {
  std::vector<SeenLandmark> seen;
  for (std::uint32_t feature = 0; feature < landmarks.size(); ++feature) {
    if (landmarks[feature].is_valid()) seen.push_back(see(features, feature, landmarks[feature]));
  }
  return seen;
}

std::optional<Rigid3> PoseRefiner::refine(const Rig& rig,
                                          const Map& map,
                                          std::span<const SeenLandmark> seen,
                                          const Rigid3& rig_from_world) {
  measure(rig, map, seen);
  if (observations_.size() < kMinObservations) return std::nullopt;
  const PoseEstimate estimate = optimize_pose(rig, observations_, rig_from_world, workspace_);
  if (estimate.num_inliers < kMinObservations ||
      static_cast<double>(estimate.num_inliers) <
          kMinInlierRatio * static_cast<double>(observations_.size())) {
    return std::nullopt;
  }
  return estimate.rig_from_world;
}

std::vector<SeenLandmark> PoseRefiner::seen_at_once(const Rig& rig,
                                                    const Map& map,
                                                    std::span<const SeenLandmark> seen,
                                                    const Rigid3& rig_from_world,
                                                    const RigMotion& motion,
                                                    float readout_s) {
  const TangentArrays& tangents = linearize(rig, map, seen);
  const RigCamera& camera = rig.cameras[0];
  std::vector<SeenLandmark> at_once;
  for (std::size_t i = 0; i < living_.size(); ++i) {
    if (!tangents.is_valid[i]) continue;
    SeenLandmark& one = at_once.emplace_back(*living_[i]);
    const Eigen::Vector3d point =
        rig_from_world * map.landmarks().at(map.resolve(one.landmark)).position_in_world;
    const auto inverse_range = static_cast<float>(1.0 / (camera.cam_from_rig * point).norm());
    const Eigen::Vector3f moved = readout_s * row_delay(*camera.camera, one.y_px) *
                                  bearing_rate(motion, camera, tangents.bearings[i], inverse_range);
    const Eigen::Vector2f moved_px =
        level_scales_[i] * (tangents.level_pixel_from_bearing[i] * moved);
    one.x_px -= moved_px.x();
    one.y_px -= moved_px.y();
  }
  return at_once;
}

const TangentArrays& PoseRefiner::linearize(const Rig& rig,
                                            const Map& map,
                                            std::span<const SeenLandmark> seen) {
  living_.clear();
  pixels_.clear();
  level_scales_.clear();
  for (const SeenLandmark& one : seen) {
    if (!map.resolve(one.landmark).is_valid()) continue;
    living_.push_back(&one);
    pixels_.emplace_back(one.x_px, one.y_px);
    level_scales_.push_back(static_cast<float>(Pyramid::scale(one.level)));
  }
  return tangents_.compute(*rig.cameras[0].camera, pixels_, level_scales_);
}

void PoseRefiner::measure(const Rig& rig, const Map& map, std::span<const SeenLandmark> seen) {
  const TangentArrays& tangents = linearize(rig, map, seen);
  observations_.clear();
  for (std::size_t i = 0; i < living_.size(); ++i) {
    if (!tangents.is_valid[i]) continue;
    const SeenLandmark& one = *living_[i];
    const float along_z = tangents.bearings[i].z();
    const Matrix23f& w = tangents.level_pixel_from_bearing[i];
    observations_.add(map.landmarks().at(map.resolve(one.landmark)).position_in_world,
                      {0,
                       tangents.bearings[i],
                       one.is_edge ? across_edge(w, kAcrossUnitRad * one.across) : w,
                       along_z * one.inverse_depth,
                       along_z * one.inverse_depth_sigma});
  }
}

std::vector<SeenLandmark> PoseRefiner::find(const Rig& rig,
                                            const Map& map,
                                            KeyframeId keyframe,
                                            const Features& features,
                                            const Rigid3& rig_from_world) {
  LandmarkSet set;
  for (LandmarkId id : map.keyframes().at(map.resolve(keyframe)).landmarks) {
    if (id.is_valid()) set.add(id, map.landmarks().at(id));
  }
  const ProjectionMatches& matches =
      matcher_.match(rig, set, features, {}, rig_from_world, {.radius_px = kRefineRadiusPx});
  std::vector<SeenLandmark> seen;
  for (std::size_t i = 0; i < set.size(); ++i) {
    if (matches.features[i] == kNoFeature) continue;
    seen.push_back(see(features, matches.features[i], set.ids[i]));
  }
  return seen;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/match/projection.h"

#include <algorithm>

#include "waymark/match/nearest.h"

namespace waymark {
namespace {

/// A feature may differ from the landmark's expected size by up to two pyramid levels.
constexpr double kMaxProjectionSizeRatio = 1.5;
constexpr std::uint32_t kNoLandmark = UINT32_MAX;

}  // namespace

ProjectionMatcher::ProjectionMatcher(std::shared_ptr<const Rig> rig) { look_with(rig); }

void ProjectionMatcher::look_with(const std::shared_ptr<const Rig>& rig) {
  const auto at =
      std::find_if(views_.begin(), views_.end(), [&](const View& view) { return view.rig == rig; });
  current_view_ = static_cast<std::size_t>(at - views_.begin());
  if (at == views_.end()) views_.push_back({rig, PixelAngles(*rig->cameras.at(0).camera)});
}

const ProjectionMatches& ProjectionMatcher::match(const LandmarkSet& landmarks,
                                                  const Features& features,
                                                  std::span<const std::uint8_t> is_taken,
                                                  const Rigid3& rig_from_world,
                                                  const ProjectionOptions& options) {
  project(landmarks, rig_from_world, options.min_direction_cos);
  matches_.features.assign(landmarks.size(), kNoFeature);
  matches_.num_matches = 0;
  landmark_of_feature_.assign(features.num_primary, kNoLandmark);
  distance_of_feature_.assign(features.num_primary, UINT16_MAX);
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    if (!matches_.is_visible[i]) continue;
    find_candidates(i, landmarks, features, is_taken, options.radius_px);
    choose(i, landmarks, features, options);
  }
  return matches_;
}

void ProjectionMatcher::project(const LandmarkSet& landmarks,
                                const Rigid3& rig_from_world,
                                double min_direction_cos) {
  const std::size_t count = landmarks.size();
  const RigCamera& camera = view().rig->cameras[0];
  const Rigid3 cam_from_world = camera.cam_from_rig * rig_from_world;
  const Eigen::Matrix3d rotation = cam_from_world.rotation_matrix();
  const Eigen::Vector3d centre = cam_from_world.origin_in_source();
  points_in_cam_.resize(count);
  pixels_.resize(count);
  matches_.is_visible.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    points_in_cam_[i] = rotation * landmarks.positions_in_world[i] + cam_from_world.translation;
  }
  camera.camera->project(points_in_cam_, pixels_, matches_.is_visible);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d to_camera = centre - landmarks.positions_in_world[i];
    matches_.is_visible[i] &=
        to_camera.dot(landmarks.directions[i]) >= min_direction_cos * to_camera.norm();
  }
}

void ProjectionMatcher::find_candidates(std::size_t landmark,
                                        const LandmarkSet& landmarks,
                                        const Features& features,
                                        std::span<const std::uint8_t> is_taken,
                                        double radius_px) {
  candidates_.clear();
  const Eigen::Vector2d pixel = pixels_[landmark];
  const double size_rad = landmarks.sizes_m[landmark] / points_in_cam_[landmark].norm();
  const double scale = std::max(1.0, size_rad / view().pixel_angles.at(pixel));
  const double radius = radius_px * scale;
  const double stretch = view().pixel_angles.column_stretch(pixel);
  const auto consider = [&](std::uint32_t feature) {
    const Keypoint& keypoint = features.keypoints[feature];
    const double dx = features.grid.column_distance_px(keypoint.x_px, pixel.x()) / stretch;
    const double dy = keypoint.y_px - pixel.y();
    if (dx * dx + dy * dy > radius * radius) return;
    const double ratio = features.size_rad[feature] / size_rad;
    if (ratio > kMaxProjectionSizeRatio || ratio < 1.0 / kMaxProjectionSizeRatio) return;
    if (!is_taken.empty() && is_taken[feature]) return;
    candidates_.push_back(feature);
  };
  features.grid.visit_window(pixel.x(), pixel.y(), radius * stretch, radius, consider);
}

void ProjectionMatcher::choose(std::size_t landmark,
                               const LandmarkSet& landmarks,
                               const Features& features,
                               const ProjectionOptions& options) {
  if (candidates_.empty()) return;
  const auto nearest = find_nearest(landmarks.descriptors[landmark],
                                    features.descriptors,
                                    candidates_,
                                    options.appearance,
                                    distances_);
  if (!nearest) return;
  const std::uint32_t feature = nearest->feature;
  if (nearest->distance >= distance_of_feature_[feature]) return;
  std::uint32_t& owner = landmark_of_feature_[feature];
  if (owner != kNoLandmark) {
    matches_.features[owner] = kNoFeature;
    --matches_.num_matches;
  }
  owner = static_cast<std::uint32_t>(landmark);
  distance_of_feature_[feature] = nearest->distance;
  matches_.features[landmark] = feature;
  ++matches_.num_matches;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/match/projection.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "waymark/features/hamming.h"
#include "waymark/match/nearest.h"

namespace waymark {
namespace {

/// A feature may differ from the landmark's expected size by up to two pyramid levels.
constexpr double kMaxProjectionSizeRatio = 1.5;
constexpr std::uint32_t kNoLandmark = UINT32_MAX;

/// A neighbour on the same edge is as good; pixels of the landmark's expected level.
constexpr double kAlongEdgePx = 8.0;
/// Between the directions across an edge, as seen and as expected.
constexpr double kMinAcrossCos = 0.9;
/// Of two edges the one whose point is not far along it, in pixels across per pixel along.
constexpr double kAlongCost = 0.1;
/// What is on both sides of an edge looks alike at least roughly.
constexpr int kMaxEdgeDistance = 100;
constexpr double kUnitsPerPx = 256.0;

}  // namespace

void ProjectionMatcher::set_view(const Rig& rig) {
  const RigCamera& camera = rig.cameras.at(0);
  auto at = std::ranges::find(views_, camera.camera, &View::camera);
  if (at == views_.end()) at = views_.insert(at, {camera.camera, PixelAngles(*camera.camera)});
  view_ = &*at;
  cam_from_rig_ = camera.cam_from_rig;
}

const ProjectionMatches& ProjectionMatcher::match(const Rig& rig,
                                                  const LandmarkSet& landmarks,
                                                  const Features& features,
                                                  std::span<const std::uint8_t> is_taken,
                                                  const Rigid3& rig_from_world,
                                                  const ProjectionOptions& options) {
  set_view(rig);
  project(landmarks, rig_from_world, options.min_direction_cos);
  matches_.features.assign(landmarks.size(), kNoFeature);
  matches_.num_matches = 0;
  landmark_of_feature_.assign(features.num_primary, kNoLandmark);
  distance_of_feature_.assign(features.num_primary, UINT16_MAX);
  project_edges(landmarks, features, rig_from_world);
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    if (!matches_.is_visible[i]) continue;
    if (!landmarks.across[i].isZero()) {
      match_edge(i, landmarks, features, is_taken, options.radius_px);
      continue;
    }
    find_candidates(i, landmarks, features, is_taken, options.radius_px);
    choose(i, landmarks, features, options);
  }
  return matches_;
}

void ProjectionMatcher::project(const LandmarkSet& landmarks,
                                const Rigid3& rig_from_world,
                                double min_direction_cos) {
  const std::size_t count = landmarks.size();
  const Rigid3 cam_from_world = cam_from_rig_ * rig_from_world;
  const Eigen::Matrix3d rotation = cam_from_world.rotation_matrix();
  const Eigen::Vector3d centre = cam_from_world.origin_in_source();
  points_in_cam_.resize(count);
  pixels_.resize(count);
  matches_.is_visible.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    points_in_cam_[i] = rotation * landmarks.positions_in_world[i] + cam_from_world.translation;
  }
  view_->camera->project(points_in_cam_, pixels_, matches_.is_visible);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d to_camera = centre - landmarks.positions_in_world[i];
    matches_.is_visible[i] &=
        to_camera.dot(landmarks.directions[i]) >= min_direction_cos * to_camera.norm();
  }
}

void ProjectionMatcher::project_edges(const LandmarkSet& landmarks,
                                      const Features& features,
                                      const Rigid3& rig_from_world) {
  edges_.clear();
  beside_in_cam_.clear();
  const Eigen::Matrix3d cam_from_world = (cam_from_rig_ * rig_from_world).rotation_matrix();
  for (std::uint32_t i = 0; i < landmarks.size(); ++i) {
    if (landmarks.across[i].isZero()) continue;
    matches_.is_visible[i] &= features.num_edges > 0;
    if (!matches_.is_visible[i]) continue;
    edges_.push_back(i);
    beside_in_cam_.push_back(points_in_cam_[i] +
                             landmarks.sizes_m[i] * (cam_from_world * landmarks.across[i]));
  }
  if (edges_.empty()) return;
  beside_px_.resize(edges_.size());
  is_beside_visible_.resize(edges_.size());
  across_px_.resize(landmarks.size());
  view_->camera->project(beside_in_cam_, beside_px_, is_beside_visible_);
  for (std::size_t k = 0; k < edges_.size(); ++k) {
    across_px_[edges_[k]] = (beside_px_[k] - pixels_[edges_[k]]).normalized();
    matches_.is_visible[edges_[k]] &= is_beside_visible_[k];
  }
}

void ProjectionMatcher::match_edge(std::size_t landmark,
                                   const LandmarkSet& landmarks,
                                   const Features& features,
                                   std::span<const std::uint8_t> is_taken,
                                   double radius_px) {
  const Eigen::Vector2d pixel = pixels_[landmark];
  const double size_rad = landmarks.sizes_m[landmark] / points_in_cam_[landmark].norm();
  const double scale = std::max(1.0, size_rad / view_->pixel_angles.at(pixel));
  const double radius = radius_px * scale;
  const double along = kAlongEdgePx * scale;
  double least_cost = std::numeric_limits<double>::infinity();
  std::uint32_t best = kNoFeature;
  const auto consider = [&](std::uint32_t feature) {
    if (!features.is_edge(feature) || (!is_taken.empty() && is_taken[feature])) return;
    const Keypoint& keypoint = features.keypoints[feature];
    const Eigen::Vector2d across = edge_normal(keypoint.angle_rad).cast<double>();
    if (across.dot(across_px_[landmark]) < kMinAcrossCos) return;
    const Eigen::Vector2d off = pixel - Eigen::Vector2d(keypoint.x_px, keypoint.y_px);
    const double off_across = std::abs(off.dot(across));
    const double off_along = std::abs(across.x() * off.y() - across.y() * off.x());
    if (off_across > radius || off_along > along) return;
    const double cost = off_across + kAlongCost * off_along;
    if (cost >= least_cost) return;
    if (hamming_distance(landmarks.descriptors[landmark], features.descriptors[feature]) >
        kMaxEdgeDistance) {
      return;
    }
    least_cost = cost;
    best = feature;
  };
  const double reach = std::max(radius, along);
  features.grid.visit_near(pixel.x(), pixel.y(), reach, consider);
  if (best == kNoFeature) return;
  take(landmark, best, static_cast<std::uint16_t>(std::min(kUnitsPerPx * least_cost, 65534.0)));
}

void ProjectionMatcher::find_candidates(std::size_t landmark,
                                        const LandmarkSet& landmarks,
                                        const Features& features,
                                        std::span<const std::uint8_t> is_taken,
                                        double radius_px) {
  candidates_.clear();
  const Eigen::Vector2d pixel = pixels_[landmark];
  const double size_rad = landmarks.sizes_m[landmark] / points_in_cam_[landmark].norm();
  const double scale = std::max(1.0, size_rad / view_->pixel_angles.at(pixel));
  const double radius = radius_px * scale;
  const double stretch = view_->pixel_angles.column_stretch(pixel);
  const auto consider = [&](std::uint32_t feature) {
    const Keypoint& keypoint = features.keypoints[feature];
    const double dx = features.grid.column_distance_px(keypoint.x_px, pixel.x()) / stretch;
    const double dy = keypoint.y_px - pixel.y();
    if (dx * dx + dy * dy > radius * radius) return;
    const double ratio = features.size_rad[feature] / size_rad;
    if (ratio > kMaxProjectionSizeRatio || ratio < 1.0 / kMaxProjectionSizeRatio) return;
    if (features.is_edge(feature)) return;
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
  take(landmark, nearest->feature, nearest->distance);
}

void ProjectionMatcher::take(std::size_t landmark, std::uint32_t feature, std::uint16_t distance) {
  if (distance >= distance_of_feature_[feature]) return;
  std::uint32_t& owner = landmark_of_feature_[feature];
  if (owner != kNoLandmark) {
    matches_.features[owner] = kNoFeature;
    --matches_.num_matches;
  }
  owner = static_cast<std::uint32_t>(landmark);
  distance_of_feature_[feature] = distance;
  matches_.features[landmark] = feature;
  ++matches_.num_matches;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/associate.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "waymark/image/range_precision.h"

namespace waymark {
namespace {

/// A point as the camera of a feature sees it.
struct Sight {
  Eigen::Vector3d direction_in_world;                    ///< Unit, from the camera to the point.
  double range_m = 0.0;                                  ///< Distance from the camera.
  std::optional<Eigen::Vector2d> residual_px;            ///< Nothing if behind the bearing.
  Matrix23d residual_from_position = Matrix23d::Zero();  ///< Derivative by the point, px/m.
};

Sight look_at(const Keyframe& keyframe,
              std::uint32_t feature,
              const Eigen::Vector3d& point_in_world) {
  const Features& features = *keyframe.features;
  const RigCamera& camera = keyframe.rig->cameras[features.keypoints[feature].camera];
  const Rigid3 cam_from_world = camera.cam_from_rig * keyframe.rig_from_world;
  const Eigen::Matrix3d rotation = cam_from_world.rotation_matrix();
  const Eigen::Vector3d point = rotation * point_in_world + cam_from_world.translation;
  const Eigen::Vector3d measured = features.bearings[feature].cast<double>();
  const Matrix23d w = features.level_pixel_from_bearing[feature].cast<double>();
  Sight sight;
  sight.range_m = point.norm();
  const Eigen::Vector3d predicted = point / sight.range_m;
  sight.direction_in_world = rotation.transpose() * predicted;
  if (predicted.dot(measured) > 0.0) sight.residual_px = w * (predicted - measured);
  const Matrix23d across = w - w * predicted * predicted.transpose();
  sight.residual_from_position = across * rotation / sight.range_m;
  return sight;
}

}  // namespace

std::optional<double> squared_residual(const Keyframe& keyframe,
                                       std::uint32_t feature,
                                       const Eigen::Vector3d& point_in_world,
                                       const Eigen::Matrix3d& covariance) {
  const Sight sight = look_at(keyframe, feature, point_in_world);
  if (!sight.residual_px) return std::nullopt;
  const Matrix23d& derivative = sight.residual_from_position;
  const Eigen::Matrix2d variance =
      Eigen::Matrix2d::Identity() + derivative * covariance * derivative.transpose();
  return sight.residual_px->dot(variance.inverse() * *sight.residual_px);
}

bool agrees(const Keyframe& keyframe,
            std::uint32_t feature,
            const Eigen::Vector3d& point_in_world,
            const Eigen::Matrix3d& covariance) {
  const std::optional<double> squared =
      squared_residual(keyframe, feature, point_in_world, covariance);
  return squared && *squared < kMaxSquaredResidual;
}

Eigen::Matrix3d position_information(const Map& map, const Landmark& landmark) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  double min_range_m = INFINITY;
  for (const Observation& observation : landmark.observations) {
    const Keyframe& keyframe = map.keyframes().at(observation.keyframe);
    const Features& features = *keyframe.features;
    const Sight sight = look_at(keyframe, observation.feature, landmark.position_in_world);
    information += sight.residual_from_position.transpose() * sight.residual_from_position;
    min_range_m = std::min(min_range_m, sight.range_m);
    if (observation.feature >= features.num_primary) continue;
    const double sigma = features.inverse_range_sigma[observation.feature];
    if (sigma <= 0.0) continue;
    const Eigen::Vector3d along =
        sight.direction_in_world / (sight.range_m * sight.range_m * sigma);
    information += along * along.transpose();
  }
  return information + Eigen::Matrix3d::Identity() / (min_range_m * min_range_m);
}

void observe_with_partner(Map& map, KeyframeId id, std::uint32_t feature, LandmarkId landmark) {
  map.observe(id, feature, landmark);
  const Keyframe& keyframe = map.keyframes().at(id);
  const std::uint32_t partner = keyframe.features->partner[feature];
  if (partner == kNoFeature || keyframe.landmarks[partner].is_valid()) return;
  if (agrees(keyframe, partner, map.landmarks().at(landmark).position_in_world)) {
    map.observe(id, partner, landmark);
  }
}

void forget_with_partner(Map& map, KeyframeId id, std::uint32_t feature) {
  const Keyframe& keyframe = map.keyframes().at(id);
  const std::uint32_t partner =
      feature < keyframe.features->num_primary ? keyframe.features->partner[feature] : kNoFeature;
  const bool has_partner = partner != kNoFeature && keyframe.landmarks[partner].is_valid();
  map.forget(id, feature);
  if (has_partner) map.forget(id, partner);
}

int add_landmarks_from_range(Map& map, KeyframeId id, DirtyLandmarks& dirty) {
  const std::shared_ptr<const Features> features = map.keyframes().at(id).features;
  const std::shared_ptr<const Rig> rig = map.keyframes().at(id).rig;
  const SubmapId submap = map.keyframes().at(id).submap;
  const Rigid3 world_from_cam =
      (rig->cameras[0].cam_from_rig * map.keyframes().at(id).rig_from_world).inverse();
  int num_added = 0;
  for (std::uint32_t i = 0; i < features->num_primary; ++i) {
    if (map.keyframes().at(id).landmarks[i].is_valid()) continue;
    if (!has_reliable_range(*rig, *features, i)) continue;
    const Eigen::Vector3d point = features->range_m[i] * features->bearings[i].cast<double>();
    const LandmarkId landmark = map.add_landmark(submap, world_from_cam * point, id);
    observe_with_partner(map, id, i, landmark);
    dirty.insert(landmark);
    ++num_added;
  }
  return num_added;
}

std::vector<KeyframeId> strongest_neighbours(const Map& map,
                                             KeyframeId keyframe,
                                             std::size_t max_count) {
  std::vector<CovisibilityEdge> edges = map.covisible(keyframe);
  std::stable_sort(edges.begin(), edges.end(), [](const auto& a, const auto& b) {
    return a.num_shared != b.num_shared ? a.num_shared > b.num_shared : a.keyframe > b.keyframe;
  });
  if (edges.size() > max_count) edges.resize(max_count);
  std::vector<KeyframeId> ids;
  for (const CovisibilityEdge& edge : edges) ids.push_back(edge.keyframe);
  return ids;
}

}  // namespace waymark

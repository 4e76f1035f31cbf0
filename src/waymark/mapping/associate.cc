// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/associate.h"

#include <Eigen/LU>
#include <algorithm>

#include "waymark/image/range_precision.h"
#include "waymark/optimize/residual.h"

namespace waymark {
namespace {

/// A point as the camera of a feature sees it.
struct SeenPoint {
  Measurement measured;
  InverseRangePoint in_cam;
  Eigen::Matrix3d cam_from_world_rotation;

  Matrix23d residual_by_position() const {
    return bearing_residual_by_point(in_cam, measured.level_pixel_from_bearing) *
           cam_from_world_rotation;
  }
};

SeenPoint look_at(const Keyframe& keyframe,
                  std::uint32_t feature,
                  const Eigen::Vector3d& point_in_world) {
  const Measurement measured = keyframe.features->measurement(feature);
  const Rigid3 cam_from_world =
      keyframe.rig->cameras[measured.camera].cam_from_rig * keyframe.rig_from_world;
  return {measured,
          in_inverse_range(cam_from_world * point_in_world),
          cam_from_world.rotation_matrix()};
}

}  // namespace

std::optional<double> squared_residual(const Keyframe& keyframe,
                                       std::uint32_t feature,
                                       const Eigen::Vector3d& point_in_world,
                                       const Eigen::Matrix3d& covariance) {
  const SeenPoint seen = look_at(keyframe, feature, point_in_world);
  if (!is_ahead(seen.in_cam, seen.measured.bearing)) return std::nullopt;
  const Eigen::Vector2d residual_px =
      bearing_residual(seen.in_cam, seen.measured.bearing, seen.measured.level_pixel_from_bearing);
  const Matrix23d derivative = seen.residual_by_position();
  const Eigen::Matrix2d variance =
      Eigen::Matrix2d::Identity() + derivative * covariance * derivative.transpose();
  return residual_px.dot(variance.inverse() * residual_px);
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
  double max_inverse_range = 0.0;
  for (const Observation& observation : landmark.observations) {
    const Keyframe& keyframe = map.keyframes().at(observation.keyframe);
    const SeenPoint seen = look_at(keyframe, observation.feature, landmark.position_in_world);
    const Matrix23d derivative = seen.residual_by_position();
    information += derivative.transpose() * derivative;
    max_inverse_range = std::max(max_inverse_range, seen.in_cam.inverse_range);
    const double sigma = seen.measured.inverse_range_sigma;
    if (sigma <= 0.0) continue;
    const Eigen::RowVector3d along =
        range_residual_by_point(seen.in_cam, sigma) * seen.cam_from_world_rotation;
    information += along.transpose() * along;
  }
  return information + max_inverse_range * max_inverse_range * Eigen::Matrix3d::Identity();
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

}  // namespace waymark

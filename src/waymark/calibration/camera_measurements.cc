// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/calibration/camera_measurements.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <map>
#include <memory>

#include "waymark/camera/calibration.h"
#include "waymark/camera/tangent.h"
#include "waymark/features/feature_geometry.h"
#include "waymark/features/pyramid.h"
#include "waymark/features/rolling_shutter.h"

namespace waymark {
namespace {

Eigen::Matrix2d projector_of(const Features& features, std::uint32_t feature) {
  if (!features.is_edge(feature)) return Eigen::Matrix2d::Identity();
  const Eigen::Vector2d normal = edge_normal(features.keypoints[feature].angle_rad).cast<double>();
  return normal * normal.transpose();
}

}  // namespace

std::vector<CameraMeasurements> collect(const Map& map,
                                        std::span<const Observation> observed,
                                        const Rig& rig,
                                        const BundleProblem& problem) {
  std::vector<CameraMeasurements> cameras(rig.cameras.size());
  for (std::size_t c = 0; c < cameras.size(); ++c) cameras[c].readout_s = rig.cameras[c].readout_s;
  for (std::size_t i = 0; i < observed.size(); ++i) {
    if (problem.rigs[problem.observations[i].pose] != &rig) continue;
    const Keyframe& keyframe = map.keyframes().at(observed[i].keyframe);
    const std::uint32_t feature = observed[i].feature;
    const Keypoint& keypoint = keyframe.features->keypoints[feature];
    CameraMeasurements& camera = cameras[keypoint.camera];
    camera.indices.push_back(i);
    camera.pixels.emplace_back(keypoint.x_px, keypoint.y_px);
    camera.level_scales.push_back(static_cast<float>(Pyramid::scale(keypoint.level)));
    camera.projectors.push_back(projector_of(*keyframe.features, feature));
    const RigCamera& calibrated = rig.cameras[keypoint.camera];
    camera.bearing_by_readout_ms.push_back(
        1e-3f * row_delay(*calibrated.camera, keypoint.y_px) *
        bearing_rate(keyframe.motion, calibrated, *keyframe.features, feature));
  }
  return cameras;
}

std::vector<Eigen::Vector3d> predict(const CameraMeasurements& measured,
                                     const Rigid3& cam_from_rig,
                                     const BundleProblem& problem) {
  std::vector<Eigen::Vector3d> directions;
  for (const std::size_t i : measured.indices) {
    const BundleObservation& observation = problem.observations[i];
    const Eigen::Vector3d point_in_rig =
        problem.rig_from_world[observation.pose] * problem.points[observation.point];
    directions.push_back((cam_from_rig * point_in_rig).normalized());
  }
  return directions;
}

void linearize(const CameraMeasurements& measured,
               const RigCamera& calibrated,
               const std::vector<Eigen::Vector3d>& directions,
               BundleProblem& problem) {
  const Camera& camera = *calibrated.camera;
  const std::size_t count = directions.size();
  std::vector<Eigen::Vector2d> pixels(count);
  std::vector<Matrix23d> jacobians(count);
  std::vector<std::uint8_t> is_visible(count);
  camera.project_with_jacobian(directions, pixels, jacobians, is_visible);
  const BearingError& error = calibrated.bearing_error;
  if (!error.along_rad.isZero(0.0) || !error.across_rad.isZero(0.0)) {
    const auto by_angles = pixel_by_epipolar_angles(calibrated, directions);
    for (std::size_t k = 0; k < count; ++k) pixels[k] += by_angles[k] * error.at(directions[k]);
  }
  const double readout_ms = 1e3 * (calibrated.readout_s - measured.readout_s);
  for (std::size_t k = 0; k < count && readout_ms != 0.0; ++k) {
    pixels[k] += jacobians[k] * (readout_ms * measured.bearing_by_readout_ms[k].cast<double>());
  }
  for (std::size_t k = 0; k < count; ++k) {
    BundleObservation& observation = problem.observations[measured.indices[k]];
    const Eigen::Vector3d& direction = directions[k];
    const Matrix23d w = (jacobians[k] - jacobians[k] * direction * direction.transpose()) /
                        measured.level_scales[k];
    if (!is_visible[k] || TangentComputer::is_stretched(w)) {
      observation.bearing.setConstant(std::numeric_limits<float>::quiet_NaN());
      continue;
    }
    const Eigen::Vector2d off = (measured.pixels[k] - pixels[k]) / measured.level_scales[k];
    const Eigen::Vector3d bearing =
        direction + w.transpose() * (w * w.transpose()).ldlt().solve(off);
    observation.bearing = bearing.cast<float>();
    observation.level_pixel_from_bearing = (measured.projectors[k] * w).cast<float>();
  }
}

void use_rig(const Rig& before, const Rig& rig, BundleProblem& problem) {
  for (const Rig*& used : problem.rigs) {
    if (used == &before) used = &rig;
  }
}

void recompute(const Map& map,
               std::span<const Observation> observed,
               const Rig& before,
               const std::shared_ptr<const Rig>& rig,
               BundleProblem& problem) {
  std::map<KeyframeId, std::shared_ptr<const Features>> features;
  for (std::size_t i = 0; i < observed.size(); ++i) {
    BundleObservation& observation = problem.observations[i];
    if (problem.rigs[observation.pose] != &before) continue;
    std::shared_ptr<const Features>& anew = features[observed[i].keyframe];
    const Keyframe& keyframe = map.keyframes().at(observed[i].keyframe);
    if (!anew) anew = recompute(*keyframe.features, rig, keyframe.motion);
    const bool has_range = observation.inverse_range_sigma > 0.0f;
    static_cast<Measurement&>(observation) = anew->measurement(observed[i].feature);
    if (!has_range) observation.inverse_range_sigma = 0.0f;
  }
  use_rig(before, *rig, problem);
}

}  // namespace waymark

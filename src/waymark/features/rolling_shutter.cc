// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/rolling_shutter.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "waymark/features/pyramid.h"

namespace waymark {

float row_delay(const Camera& camera, float y_px) {
  return y_px / static_cast<float>(camera.height_px() - 1) - 0.5f;
}

Eigen::Vector3f camera_shift(const RigMotion& motion, const RigCamera& camera) {
  const Eigen::Matrix3f rotation = camera.cam_from_rig.rotation_matrix().cast<float>();
  const Eigen::Vector3f turn = rotation * motion.turn_rad_s;
  return rotation * motion.shift_per_s - turn.cross(camera.cam_from_rig.translation.cast<float>());
}

Eigen::Vector3f bearing_rate(const RigMotion& motion,
                             const RigCamera& camera,
                             const Eigen::Vector3f& bearing,
                             float inverse_range) {
  const Eigen::Vector3f turn =
      camera.cam_from_rig.rotation_matrix().cast<float>() * motion.turn_rad_s;
  const Eigen::Vector3f shift = camera_shift(motion, camera);
  return turn.cross(bearing) + inverse_range * (shift - bearing.dot(shift) * bearing);
}

Eigen::Vector3f bearing_rate(const RigMotion& motion,
                             const RigCamera& camera,
                             const Features& features,
                             std::size_t feature) {
  const std::size_t primary = feature < features.num_primary ? feature : features.partner[feature];
  const float range_m = features.range_m[primary];
  const float inverse_range =
      range_m == 0.0f ? motion.inverse_range : std::max(1.0f / range_m, 0.0f);
  return bearing_rate(motion, camera, features.bearings[feature], inverse_range);
}

bool correct_rolling(const Rig& rig, const RigMotion& motion, Features& features) {
  const RigMotion before = features.motion;
  const auto before_s = features.readout_s;
  for (std::size_t c = 0; c < std::min(rig.cameras.size(), before_s.size()); ++c) {
    const bool is_known = motion != RigMotion{};
    features.readout_s[c] = is_known ? static_cast<float>(rig.cameras[c].readout_s) : 0.0f;
  }
  features.motion = motion;
  if (before_s == features.readout_s && (before == motion || before_s == std::array<float, 2>{})) {
    return false;
  }
  for (std::size_t i = 0; i < features.size(); ++i) {
    Keypoint& keypoint = features.keypoints[i];
    const RigCamera& camera = rig.cameras[keypoint.camera];
    const Eigen::Vector3f by =
        before_s[keypoint.camera] * bearing_rate(before, camera, features, i) -
        features.readout_s[keypoint.camera] * bearing_rate(motion, camera, features, i);
    const float delay_px = static_cast<float>(Pyramid::scale(keypoint.level)) *
                           row_delay(*camera.camera, keypoint.y_px);
    const Eigen::Vector2f shift_px = delay_px * (features.level_pixel_from_bearing[i] * by);
    keypoint.x_px += shift_px.x();
    keypoint.y_px += shift_px.y();
  }
  return true;
}

}  // namespace waymark

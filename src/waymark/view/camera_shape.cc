// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/camera_shape.h"

namespace waymark {
namespace {

constexpr int kSteps = 40;

/// The direction of the outermost pixel between the centre of an image and a corner; 0 if there is
/// none.
Eigen::Vector3d direction_towards(const Camera& camera, const Eigen::Vector2d& corner_px) {
  const Eigen::Vector2d centre_px(0.5 * (camera.width_px() - 1), 0.5 * (camera.height_px() - 1));
  for (int step = kSteps; step > 0; --step) {
    const Eigen::Vector2d pixel = centre_px + step * (corner_px - centre_px) / kSteps;
    Eigen::Vector3d bearing;
    std::uint8_t is_valid = 0;
    camera.unproject({&pixel, 1}, {&bearing, 1}, {&is_valid, 1});
    if (is_valid) return bearing;
  }
  return Eigen::Vector3d::Zero();
}

}  // namespace

CameraShape shape_of(const RigCamera& rig_camera) {
  const Camera& camera = *rig_camera.camera;
  CameraShape shape;
  shape.position_in_rig = rig_camera.cam_from_rig.origin_in_source();
  shape.is_sphere = camera.wrap_width_px() > 0.0;
  if (shape.is_sphere) return shape;
  const double right = camera.width_px() - 1;
  const double bottom = camera.height_px() - 1;
  const std::array<Eigen::Vector2d, 4> corners_px{Eigen::Vector2d(0, 0),
                                                  Eigen::Vector2d(right, 0),
                                                  Eigen::Vector2d(right, bottom),
                                                  Eigen::Vector2d(0, bottom)};
  for (std::size_t i = 0; i < corners_px.size(); ++i) {
    shape.corners_in_rig[i] =
        rig_camera.cam_from_rig.rotation.conjugate() * direction_towards(camera, corners_px[i]);
  }
  return shape;
}

}  // namespace waymark

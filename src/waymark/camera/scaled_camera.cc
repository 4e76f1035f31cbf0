// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/scaled_camera.h"

#include <utility>
#include <vector>

namespace waymark {

ScaledCamera::ScaledCamera(std::shared_ptr<const Camera> camera, double factor)
    : Camera(static_cast<int>(factor * camera->width_px()),
             static_cast<int>(factor * camera->height_px())),
      camera_(std::move(camera)),
      factor_(factor) {}

void ScaledCamera::project(std::span<const Eigen::Vector3d> points_in_cam,
                           std::span<Eigen::Vector2d> pixels,
                           std::span<std::uint8_t> is_visible) const {
  camera_->project(points_in_cam, pixels, is_visible);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!is_visible[i]) continue;
    pixels[i] = scaled(pixels[i]);
    is_visible[i] = contains(pixels[i]);
  }
}

void ScaledCamera::project_with_jacobian(std::span<const Eigen::Vector3d> points_in_cam,
                                         std::span<Eigen::Vector2d> pixels,
                                         std::span<Matrix23d> pixel_from_point,
                                         std::span<std::uint8_t> is_visible) const {
  camera_->project_with_jacobian(points_in_cam, pixels, pixel_from_point, is_visible);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!is_visible[i]) continue;
    pixels[i] = scaled(pixels[i]);
    pixel_from_point[i] *= factor_;
    is_visible[i] = contains(pixels[i]);
  }
}

void ScaledCamera::unproject(std::span<const Eigen::Vector2d> pixels,
                             std::span<Eigen::Vector3d> bearings,
                             std::span<std::uint8_t> is_valid) const {
  std::vector<Eigen::Vector2d> unscaled(pixels.begin(), pixels.end());
  for (Eigen::Vector2d& pixel : unscaled) pixel = (pixel.array() + 0.5) / factor_ - 0.5;
  camera_->unproject(unscaled, bearings, is_valid);
  // What the camera itself would not show has no projection either.
  for (std::size_t i = 0; i < unscaled.size(); ++i) is_valid[i] &= camera_->contains(unscaled[i]);
}

}  // namespace waymark

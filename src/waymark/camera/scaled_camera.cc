// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/scaled_camera.h"

#include <utility>
#include <vector>

namespace waymark {

ScaledCamera::ScaledCamera(std::shared_ptr<const Camera> camera, double factor, const Image& image)
    : Camera(image.width_px, image.height_px),
      camera_(std::move(camera)),
      factor_(factor),
      wrap_width_px_(image.wrap_width_px),
      fixed_px_(image.fixed_px) {}

ScaledCamera ScaledCamera::refocused(std::shared_ptr<const Camera> camera, double factor) {
  const Image image{camera->width_px(), camera->height_px(), 0.0, principal_point(*camera)};
  return {std::move(camera), factor, image};
}

ScaledCamera ScaledCamera::resized(std::shared_ptr<const Camera> camera, double factor) {
  const Image image{static_cast<int>(factor * camera->width_px()),
                    static_cast<int>(factor * camera->height_px()),
                    factor * camera->wrap_width_px(),
                    {-0.5, -0.5}};
  return {std::move(camera), factor, image};
}

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
  for (Eigen::Vector2d& pixel : unscaled) pixel = fixed_px_ + (pixel - fixed_px_) / factor_;
  camera_->unproject(unscaled, bearings, is_valid);
  // What the camera itself would not show has no projection either.
  for (std::size_t i = 0; i < unscaled.size(); ++i) is_valid[i] &= camera_->contains(unscaled[i]);
}

Eigen::Vector2d principal_point(const Camera& camera) {
  const Eigen::Vector3d ahead(0.0, 0.0, 1.0);
  Eigen::Vector2d pixel;
  std::uint8_t is_visible = 0;
  camera.project({&ahead, 1}, {&pixel, 1}, {&is_visible, 1});
  if (is_visible) return pixel;
  return {0.5 * camera.width_px() - 0.5, 0.5 * camera.height_px() - 0.5};
}

}  // namespace waymark

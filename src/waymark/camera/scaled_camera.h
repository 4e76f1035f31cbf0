// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "waymark/camera/camera.h"

namespace waymark {

/// The camera of images that are resized by a factor, their size rounded down. The corner of the
/// image stays where it is, and so does distortion, which acts before the focal length.
class ScaledCamera final : public Camera {
 public:
  ScaledCamera(std::shared_ptr<const Camera> camera, double factor);

  std::string_view model() const override { return camera_->model(); }
  double wrap_width_px() const override { return factor_ * camera_->wrap_width_px(); }

  void project(std::span<const Eigen::Vector3d> points_in_cam,
               std::span<Eigen::Vector2d> pixels,
               std::span<std::uint8_t> is_visible) const override;
  void project_with_jacobian(std::span<const Eigen::Vector3d> points_in_cam,
                             std::span<Eigen::Vector2d> pixels,
                             std::span<Matrix23d> pixel_from_point,
                             std::span<std::uint8_t> is_visible) const override;
  void unproject(std::span<const Eigen::Vector2d> pixels,
                 std::span<Eigen::Vector3d> bearings,
                 std::span<std::uint8_t> is_valid) const override;

 private:
  Eigen::Vector2d scaled(const Eigen::Vector2d& pixel) const {
    return factor_ * (pixel.array() + 0.5) - 0.5;
  }

  std::shared_ptr<const Camera> camera_;
  double factor_;
};

}  // namespace waymark

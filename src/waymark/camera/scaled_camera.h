// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "waymark/camera/camera.h"

namespace waymark {

/// A camera whose focal lengths are larger by a factor: pixels move away from the principal point.
/// Distortion, which acts before the focal length, stays; so does what part of the world is seen,
/// if the factor is below 1.
class ScaledCamera final : public Camera {
 public:
  ScaledCamera(std::shared_ptr<const Camera> camera, double factor);

  std::string_view model() const override { return camera_->model(); }

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
    return center_px_ + factor_ * (pixel - center_px_);
  }

  std::shared_ptr<const Camera> camera_;
  double factor_;
  Eigen::Vector2d center_px_;
};

/// Where a camera sees straight ahead; the centre of the image if it does not.
Eigen::Vector2d principal_point(const Camera& camera);

}  // namespace waymark

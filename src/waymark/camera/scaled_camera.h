// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "waymark/camera/camera.h"

namespace waymark {

/// A camera whose pixels are further by a factor from a point that stays. Distortion, which acts
/// before the focal length, stays, too.
class ScaledCamera final : public Camera {
 public:
  /// Larger focal lengths by the factor: around the principal point, in an image of the same size.
  /// With a factor below 1 the same part of the world is seen.
  static ScaledCamera refocused(std::shared_ptr<const Camera> camera, double factor);
  /// The camera of images that are resized by the factor, their size rounded down; the corner of
  /// the image stays where it is.
  static ScaledCamera resized(std::shared_ptr<const Camera> camera, double factor);

  std::string_view model() const override { return camera_->model(); }
  double wrap_width_px() const override { return wrap_width_px_; }

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
  struct Image {
    int width_px;
    int height_px;
    double wrap_width_px;
    Eigen::Vector2d fixed_px;  ///< The point that stays.
  };
  ScaledCamera(std::shared_ptr<const Camera> camera, double factor, const Image& image);

  Eigen::Vector2d scaled(const Eigen::Vector2d& pixel) const {
    return fixed_px_ + factor_ * (pixel - fixed_px_);
  }

  std::shared_ptr<const Camera> camera_;
  double factor_;
  double wrap_width_px_;
  Eigen::Vector2d fixed_px_;
};

/// Where a camera sees straight ahead; the centre of the image if it does not.
Eigen::Vector2d principal_point(const Camera& camera);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A camera of one's own: three functions of one point; examples/custom_camera is a whole one.
//
//   struct Pinhole {
//     static constexpr std::string_view kName = "my_pinhole";
//     double f, u, v;  // px
//     std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p) const {
//       if (p.z() <= 0.0) return std::nullopt;
//       return Eigen::Vector2d(f * p.x() / p.z() + u, f * p.y() / p.z() + v);
//     }
//     std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const {
//       return Eigen::Vector3d((pixel.x() - u) / f, (pixel.y() - v) / f, 1.0).normalized();
//     }
//     Matrix23d jacobian(const Eigen::Vector3d& p) const {
//       return (Matrix23d() << f, 0.0, -f * p.x() / p.z(), 0.0, f, -f * p.y() / p.z()).finished() /
//       p.z();
//     }
//   };
//   inline std::shared_ptr<const Camera> make_pinhole() {
//     return std::make_shared<ModelCamera<Pinhole>>(Pinhole{400.0, 320.0, 240.0}, 640, 480);
//   }

#include <concepts>
#include <optional>
#include <string_view>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/camera/camera.h"

namespace waymark {

/// A camera model: a plain struct with its name and three functions for one point or pixel.
///
///   static constexpr std::string_view kName;                                // as in settings
///   std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_in_cam) const;
///   std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const;  // unit length
///   Matrix23d jacobian(const Eigen::Vector3d& point_in_cam) const;          // d pixel / d point
///
/// project and unproject return nothing outside the model's field of view; they need not look at
/// the image bounds. jacobian is asked only where project succeeded. A model whose columns repeat
/// (360 degrees) also has `double wrap_width_px() const`.
template <class Model>
concept CameraModel = requires(const Model& model,
                               const Eigen::Vector3d& point_in_cam,
                               const Eigen::Vector2d& pixel) {
  { Model::kName } -> std::convertible_to<std::string_view>;
  { model.project(point_in_cam) } -> std::same_as<std::optional<Eigen::Vector2d>>;
  { model.unproject(pixel) } -> std::same_as<std::optional<Eigen::Vector3d>>;
  { model.jacobian(point_in_cam) } -> std::same_as<Matrix23d>;
};

/// Makes a Camera of a model struct; the loops live here, so that the compiler inlines the model.
template <CameraModel Model>
class ModelCamera final : public Camera {
 public:
  /// A camera with these parameters and an image of this size.
  ModelCamera(Model model, int width_px, int height_px)
      : Camera(width_px, height_px), parameters_(std::move(model)) {}

  /// The model struct.
  const Model& parameters() const { return parameters_; }

  std::string_view model() const override { return Model::kName; }

  void project(std::span<const Eigen::Vector3d> points_in_cam,
               std::span<Eigen::Vector2d> pixels,
               std::span<std::uint8_t> is_visible) const override {
    WAYMARK_CHECK(pixels.size() == points_in_cam.size());
    WAYMARK_CHECK(is_visible.size() == points_in_cam.size());
    for (std::size_t i = 0; i < points_in_cam.size(); ++i) {
      is_visible[i] = project_one(points_in_cam[i], pixels[i]);
    }
  }

  void project_with_jacobian(std::span<const Eigen::Vector3d> points_in_cam,
                             std::span<Eigen::Vector2d> pixels,
                             std::span<Matrix23d> pixel_from_point,
                             std::span<std::uint8_t> is_visible) const override {
    WAYMARK_CHECK(pixels.size() == points_in_cam.size());
    WAYMARK_CHECK(pixel_from_point.size() == points_in_cam.size());
    WAYMARK_CHECK(is_visible.size() == points_in_cam.size());
    for (std::size_t i = 0; i < points_in_cam.size(); ++i) {
      is_visible[i] = project_one(points_in_cam[i], pixels[i]);
      if (is_visible[i]) pixel_from_point[i] = parameters_.jacobian(points_in_cam[i]);
    }
  }

  void unproject(std::span<const Eigen::Vector2d> pixels,
                 std::span<Eigen::Vector3d> bearings,
                 std::span<std::uint8_t> is_valid) const override {
    WAYMARK_CHECK(bearings.size() == pixels.size());
    WAYMARK_CHECK(is_valid.size() == pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const std::optional<Eigen::Vector3d> bearing = parameters_.unproject(pixels[i]);
      is_valid[i] = bearing.has_value();
      if (bearing) bearings[i] = *bearing;
    }
  }

  double wrap_width_px() const override {
    if constexpr (requires { parameters_.wrap_width_px(); }) {
      return parameters_.wrap_width_px();
    } else {
      return 0.0;
    }
  }

 private:
  bool project_one(const Eigen::Vector3d& point_in_cam, Eigen::Vector2d& pixel) const {
    const std::optional<Eigen::Vector2d> projected = parameters_.project(point_in_cam);
    if (!projected || !contains(*projected)) return false;
    pixel = *projected;
    return true;
  }

  Model parameters_;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <string_view>

#include "waymark/camera/model_camera.h"
#include "waymark/camera/registry.h"

/// A camera that looks into a hyperbolic mirror (Baker and Nayar 1999, A theory of single-viewpoint
/// catadioptric image formation). The shortest way to a model of one's own: a plain struct with
/// three functions for one point or pixel; ModelCamera derives from waymark::Camera and loops.
/// +z points from the mirror to the lens, so that the middle of the image shows the lens itself.
struct MirrorModel {
  static constexpr std::string_view kName = "hyperbolic_mirror";

  double xi;        ///< 2 e / (1 + e^2) of the hyperbola's eccentricity e.
  double focal_px;  ///< Of lens and mirror together.
  Eigen::Vector2d center_px;
  double lens_px;  ///< Radius of the lens's own image,
  double rim_px;   ///< and of the mirror's rim.

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_in_cam) const {
    const double denominator = point_in_cam.z() + xi * point_in_cam.norm();
    if (!(denominator > 0.0)) return std::nullopt;
    const Eigen::Vector2d offset = focal_px / denominator * point_in_cam.head<2>();
    if (!is_on_mirror(offset)) return std::nullopt;
    return center_px + offset;
  }

  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d offset = pixel - center_px;
    if (!is_on_mirror(offset)) return std::nullopt;
    const Eigen::Vector2d p = offset / focal_px;
    const double s = p.squaredNorm();
    const double scale = (xi + std::sqrt(1.0 + (1.0 - xi * xi) * s)) / (1.0 + s);
    return Eigen::Vector3d(scale * p.x(), scale * p.y(), scale - xi).normalized();
  }

  waymark::Matrix23d jacobian(const Eigen::Vector3d& point_in_cam) const {
    const double inverse = 1.0 / (point_in_cam.z() + xi * point_in_cam.norm());
    Eigen::RowVector3d of_denominator = xi * point_in_cam.normalized().transpose();
    of_denominator.z() += 1.0;
    waymark::Matrix23d result = -inverse * inverse * point_in_cam.head<2>() * of_denominator;
    result.diagonal().array() += inverse;
    return focal_px * result;
  }

  bool is_on_mirror(const Eigen::Vector2d& offset) const {
    const double radius = offset.norm();
    return radius >= lens_px && radius <= rim_px;
  }

  static void add_to(waymark::CameraRegistry& registry) {
    registry.add(std::string(kName), [](const waymark::CameraDescription& camera) {
      waymark::expect_intrinsics(camera, "eccentricity fu pu pv lens rim");
      waymark::expect_no_distortion(camera);
      const auto& v = camera.intrinsics;
      if (!(v[0] > 0.0 && v[0] != 1.0)) camera.fail("eccentricity must be positive and not 1");
      const double xi = 2.0 * v[0] / (1.0 + v[0] * v[0]);
      return std::make_shared<const waymark::ModelCamera<MirrorModel>>(
          MirrorModel{xi, v[1], {v[2], v[3]}, v[4], v[5]}, camera.width_px, camera.height_px);
    });
  }
};

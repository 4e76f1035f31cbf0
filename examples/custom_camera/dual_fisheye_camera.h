// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <memory>
#include <numbers>

#include "waymark/camera/registry.h"

/// Two fisheye lenses back to back in one image, as 360 degree cameras deliver it unstitched: left
/// what is ahead (+z), right what is behind. Derives from the base class itself, in batch form.
class DualFisheyeCamera final : public waymark::Camera {
 public:
  DualFisheyeCamera(double focal_px, int width_px, int height_px)
      : Camera(width_px, height_px), focal_px_(focal_px) {}

  std::string_view model() const override { return "dual_fisheye"; }

  void project(std::span<const Eigen::Vector3d> points,
               std::span<Eigen::Vector2d> pixels,
               std::span<std::uint8_t> is_visible) const override {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool front = points[i].z() > 0.0;
      const Eigen::Vector3d p = turn(points[i], front);
      const double side = p.head<2>().norm(), angle = std::atan2(side, p.z());
      const double scale = side > 0.0 ? focal_px_ * angle / side : 0.0;
      pixels[i] = center(front) + scale * p.head<2>();
      is_visible[i] = std::isfinite(scale) && p.norm() > 0.0 && contains(pixels[i]);
    }
  }

  void project_with_jacobian(std::span<const Eigen::Vector3d> points,
                             std::span<Eigen::Vector2d> pixels,
                             std::span<waymark::Matrix23d> jacobians,
                             std::span<std::uint8_t> is_visible) const override {
    project(points, pixels, is_visible);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d sign = turn(Eigen::Vector3d::Ones(), points[i].z() > 0.0);
      const Eigen::Vector3d p = sign.cwiseProduct(points[i]);
      const double side = std::fmax(p.head<2>().norm(), 1e-12 * p.z());
      const double along = p.z() / p.squaredNorm(), across = std::atan2(side, p.z()) / side;
      const Eigen::Vector2d out = p.head<2>() / side;
      jacobians[i] << (along - across) * out * out.transpose(), -side / p.squaredNorm() * out;
      jacobians[i].diagonal().array() += across;
      jacobians[i] *= focal_px_ * sign.asDiagonal();
    }
  }

  void unproject(std::span<const Eigen::Vector2d> pixels,
                 std::span<Eigen::Vector3d> bearings,
                 std::span<std::uint8_t> is_valid) const override {
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const bool front = pixels[i].x() < 0.5 * width_px() - 0.5;
      const Eigen::Vector2d offset = pixels[i] - center(front);
      const double angle = offset.norm() / focal_px_;
      is_valid[i] = angle < 0.5 * std::numbers::pi;
      const double scale = angle > 0.0 ? std::sin(angle) / (focal_px_ * angle) : 0.0;
      bearings[i] = turn({scale * offset.x(), scale * offset.y(), std::cos(angle)}, front);
    }
  }

  static void add_to(waymark::CameraRegistry& registry) {
    registry.add("dual_fisheye", [](const waymark::CameraDescription& camera) {
      waymark::expect_intrinsics(camera, "fu");
      const double focal_px = camera.intrinsics[0];
      return std::make_shared<DualFisheyeCamera>(focal_px, camera.width_px, camera.height_px);
    });
  }

 private:
  static Eigen::Vector3d turn(const Eigen::Vector3d& p, bool front) {
    return front ? p : Eigen::Vector3d(-p.x(), p.y(), -p.z());
  }
  Eigen::Vector2d center(bool front) const {
    return {(front ? 0.25 : 0.75) * width_px() - 0.5, 0.5 * height_px() - 0.5};
  }
  double focal_px_;
};

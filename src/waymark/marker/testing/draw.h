// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/camera/camera.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/image/image.h"
#include "waymark/marker/family.h"

namespace waymark::testing {

/// A marker on white paper before a grey wall, as any camera sees it: each pixel the mean of 6 x 6
/// rays. noise_sigma: of grey values.
inline Image draw_marker(const Camera& camera,
                         const MarkerFamily& family,
                         int id,
                         const Rigid3& cam_from_marker,
                         double side,
                         double noise_sigma,
                         std::uint64_t seed = 1) {
  constexpr int kRays = 6;
  const int count = family.side_modules();
  const std::vector<std::uint8_t> modules = family.modules(id);
  const Rigid3 marker_from_cam = cam_from_marker.inverse();
  const Eigen::Vector3d eye = marker_from_cam.translation;
  Image image(camera.width_px(), camera.height_px());
  std::vector<Eigen::Vector2d> pixels;
  for (int x = 0; x < image.width_px * kRays; ++x) pixels.push_back({(x + 0.5) / kRays - 0.5, 0.0});
  std::vector<Eigen::Vector3d> bearings(pixels.size());
  std::vector<std::uint8_t> is_valid(pixels.size());
  Rng rng(seed, 0);
  for (int y = 0; y < image.height_px; ++y) {
    std::vector<double> sums(static_cast<std::size_t>(image.width_px), 0.0);
    for (int ray = 0; ray < kRays; ++ray) {
      for (Eigen::Vector2d& pixel : pixels) pixel.y() = y + (ray + 0.5) / kRays - 0.5;
      camera.unproject(pixels, bearings, is_valid);
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        double grey = 0.0;
        if (is_valid[i]) {
          grey = 110.0;
          const Eigen::Vector3d ahead = marker_from_cam.rotation * bearings[i];
          const double distance = -eye.z() / ahead.z();
          const double u = (eye.x() + distance * ahead.x()) / side + 0.5;
          const double v = 0.5 - (eye.y() + distance * ahead.y()) / side;
          if (distance > 0.0 && std::abs(u - 0.5) < 0.65 && std::abs(v - 0.5) < 0.65) grey = 220.0;
          if (distance > 0.0 && u > 0.0 && v > 0.0 && u < 1.0 && v < 1.0) {
            const auto module = static_cast<std::size_t>(static_cast<int>(v * count) * count +
                                                         static_cast<int>(u * count));
            grey = modules[module] ? 220.0 : 30.0;
          }
        }
        sums[i / kRays] += grey / (kRays * kRays);
      }
    }
    for (int x = 0; x < image.width_px; ++x) {
      const double grey = sums[static_cast<std::size_t>(x)] + noise_sigma * rng.normal();
      image.row(y)[x] =
          static_cast<std::uint8_t>(std::lround(std::min(std::max(grey, 0.0), 255.0)));
    }
  }
  return image;
}

/// cam_from_marker of a marker that is seen from `tilt` radians beside its normal, turned about
/// that by `turn`, in a direction of the camera.
inline Rigid3 look_at_marker(const Eigen::Vector3d& direction,
                             double distance,
                             double tilt,
                             double turn) {
  const Eigen::Quaterniond facing(
      Eigen::AngleAxisd(3.14159265358979, Eigen::Vector3d::UnitX()));  // z of it to the camera.
  const Eigen::Quaterniond away =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), direction.normalized());
  const Eigen::Quaterniond tilted(Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitY()));
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()));
  return {(away * turned * tilted * facing).normalized(), distance * direction.normalized()};
}

}  // namespace waymark::testing

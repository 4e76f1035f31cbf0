// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/camera/camera.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/image/image.h"

namespace waymark::testing {

/// A rectangle in the world, with a random smooth texture.
struct TexturedPlane {
  Eigen::Vector3d center;
  Eigen::Vector3d right;  ///< Unit, in the plane.
  Eigen::Vector3d down;   ///< Unit, in the plane, perpendicular to `right`.
  double half_size_m;
  double texel_m;  ///< Size of the texture's details.
};

/// Distances along bearings and images of planes, exact but for rounding to grey values.
class PlaneScene {
 public:
  explicit PlaneScene(std::vector<TexturedPlane> planes) : planes_(std::move(planes)) {}

  /// Distance along a unit direction from an origin, both in the world.
  std::optional<double> range(const Eigen::Vector3d& origin,
                              const Eigen::Vector3d& direction) const {
    const Hit hit = cast(origin, direction);
    if (!hit.plane) return std::nullopt;
    return hit.range;
  }

  /// Four rays per pixel.
  Image render(const Camera& camera, const Rigid3& cam_from_world) const {
    Image image(camera.width_px(), camera.height_px());
    std::vector<Eigen::Vector2d> pixels;
    for (int y = 0; y < image.height_px; ++y) {
      for (int x = 0; x < image.width_px; ++x) {
        for (const double dy : {-0.25, 0.25}) {
          for (const double dx : {-0.25, 0.25}) pixels.emplace_back(x + dx, y + dy);
        }
      }
    }
    std::vector<Eigen::Vector3d> bearings(pixels.size());
    std::vector<std::uint8_t> is_valid(pixels.size());
    camera.unproject(pixels, bearings, is_valid);
    const Rigid3 world_from_cam = cam_from_world.inverse();
    for (std::size_t i = 0; i < image.values.size(); ++i) {
      double sum = 0.0;
      for (std::size_t k = 4 * i; k < 4 * i + 4; ++k) {
        if (!is_valid[k]) continue;
        sum += shade(cast(world_from_cam.translation, world_from_cam.rotation * bearings[k]));
      }
      image.values[i] = static_cast<std::uint8_t>(std::lround(std::clamp(sum / 4.0, 0.0, 255.0)));
    }
    return image;
  }

 private:
  struct Hit {
    const TexturedPlane* plane = nullptr;
    double range = std::numeric_limits<double>::infinity();
    double x_m = 0.0;
    double y_m = 0.0;
  };

  Hit cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    Hit best;
    for (const TexturedPlane& plane : planes_) {
      const Eigen::Vector3d normal = plane.right.cross(plane.down);
      const double range = (plane.center - origin).dot(normal) / direction.dot(normal);
      if (!(range > 0.0 && range < best.range)) continue;
      const Eigen::Vector3d offset = origin + range * direction - plane.center;
      const double x = offset.dot(plane.right);
      const double y = offset.dot(plane.down);
      if (std::max(std::abs(x), std::abs(y)) > plane.half_size_m) continue;
      best = {&plane, range, x, y};
    }
    return best;
  }

  double shade(const Hit& hit) const {
    if (!hit.plane) return 0.0;
    const double u = hit.x_m / hit.plane->texel_m + 1000.0;
    const double v = hit.y_m / hit.plane->texel_m + 1000.0;
    const auto seed = static_cast<std::uint64_t>(hit.plane - planes_.data());
    return 128.0 + 90.0 * noise(u, v, seed) + 60.0 * noise(u / 3.1, v / 3.1, seed + 100);
  }

  /// Smooth noise in [-1, 1] with random values at integer places.
  static double noise(double u, double v, std::uint64_t seed) {
    const double left = std::floor(u);
    const double top = std::floor(v);
    const auto at = [&](double x, double y) {
      return Rng(seed, static_cast<std::uint64_t>(x) * 65536 + static_cast<std::uint64_t>(y))
          .uniform(-1.0, 1.0);
    };
    const auto smooth = [](double t) { return t * t * (3.0 - 2.0 * t); };
    const double fx = smooth(u - left);
    const double fy = smooth(v - top);
    return std::lerp(std::lerp(at(left, top), at(left + 1, top), fx),
                     std::lerp(at(left, top + 1), at(left + 1, top + 1), fx),
                     fy);
  }

  std::vector<TexturedPlane> planes_;
};

}  // namespace waymark::testing

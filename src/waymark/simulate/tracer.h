// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "waymark/simulate/world.h"

namespace waymark {

/// Rays of a tile of the image, that start in the eye; single precision, arrays in parallel.
struct RayTile {
  static constexpr int kCapacity = 17 * 33;
  static constexpr std::int32_t kSky = -1;
  static constexpr std::int32_t kNoRay = -2;

  int count = 0;
  alignas(64) std::array<float, kCapacity> x;  ///< Directions in the world frame, any length > 0.
  alignas(64) std::array<float, kCapacity> y;
  alignas(64) std::array<float, kCapacity> z;
  alignas(64) std::array<float, kCapacity> distance;  ///< In multiples of the direction's length.
  alignas(
      64) std::array<std::int32_t, kCapacity> hit;  ///< Index for Tracer::surface, kSky, kNoRay.

  void clear() { count = 0; }
  /// Zero for no ray.
  void add(const Eigen::Vector3f& direction);
  Eigen::Vector3f direction(int i) const {
    const std::size_t k = static_cast<std::size_t>(i);
    return {x[k], y[k], z[k]};
  }
};

/// A surface relative to the eye: coordinates along its axes (u, v, normal).
struct TraceSurface {
  SurfaceKind kind = SurfaceKind::kRectangle;
  std::uint32_t index = 0;  ///< In World::surfaces.
  Eigen::Vector3f u_axis, v_axis, normal;
  Eigen::Vector3f eye;  ///< In the surface's axes, from its origin.
  Eigen::Vector2f size;
  float radius = 0.0f;
  float nearest = 0.0f;             ///< No point of it is closer to the eye.
  Eigen::Vector3f bounding_centre;  ///< World axes, from the eye.
  float bounding_radius = 0.0f;

  /// Surface coordinates where the unbounded surface meets the ray; what it gives for a ray that
  /// misses is finite, but means nothing.
  Eigen::Vector2f uv(const Eigen::Vector3f& direction, float distance) const;
  /// Distance of the unbounded surface, or infinity.
  float distance_along(const Eigen::Vector3f& direction) const;
};

/// Finds what rays from one eye meet first. Culls surfaces per tile: by the cone around the rays,
/// and by distance once everything in the tile is covered.
class Tracer {
 public:
  Tracer(std::span<const Surface> surfaces, const Eigen::Vector3d& eye);

  /// Fills distance and hit of the tile.
  void trace(RayTile& tile) const;
  /// Nearest hit of one ray of a tile that was traced before; candidates as found by candidates().
  std::int32_t trace_one(const Eigen::Vector3f& direction,
                         const std::vector<std::int32_t>& candidates,
                         float& distance) const;
  /// Indices of surfaces that rays of the tile may meet, nearest first.
  void candidates(const RayTile& tile, std::vector<std::int32_t>& result) const;

  const TraceSurface& surface(std::int32_t hit) const {
    return surfaces_[static_cast<std::size_t>(hit)];
  }

 private:
  std::vector<TraceSurface> surfaces_;  ///< Those that face the eye, by nearest.
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/tracer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "waymark/base/check.h"

namespace waymark {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kSeam = static_cast<float>(kSeamM);

/// The smaller; NaN gives b. Compiles to one instruction.
inline float lesser(float a, float b) { return a < b ? a : b; }

/// The functions below give the distance along the ray (x, y, z), or infinity where it misses:
/// where the least of the margins to the surface's bounds is negative. They select instead of
/// branching, so that loops over them vectorise.
inline float hit_rectangle(const TraceSurface& s, float x, float y, float z) {
  const float across = -(s.normal.x() * x + s.normal.y() * y + s.normal.z() * z);
  const float t = s.eye.z() / across;
  const float u = s.eye.x() + t * (s.u_axis.x() * x + s.u_axis.y() * y + s.u_axis.z() * z);
  const float v = s.eye.y() + t * (s.v_axis.x() * x + s.v_axis.y() * y + s.v_axis.z() * z);
  const float inside_u = lesser(u, s.size.x() - u);
  const float inside_v = lesser(v, s.size.y() - v);
  const float margin = lesser(lesser(inside_u, inside_v) + kSeam, across);
  return margin > 0.0f ? t : kInfinity;
}

inline float hit_disc(const TraceSurface& s, float x, float y, float z) {
  const float across = -(s.normal.x() * x + s.normal.y() * y + s.normal.z() * z);
  const float t = s.eye.z() / across;
  const float u = s.eye.x() + t * (s.u_axis.x() * x + s.u_axis.y() * y + s.u_axis.z() * z);
  const float v = s.eye.y() + t * (s.v_axis.x() * x + s.v_axis.y() * y + s.v_axis.z() * z);
  const float du = u - s.radius;
  const float dv = v - s.radius;
  const float margin = lesser(s.radius * s.radius - du * du - dv * dv, across);
  return margin > 0.0f ? t : kInfinity;
}

inline float hit_cylinder(const TraceSurface& s, float x, float y, float z) {
  const float a = s.u_axis.x() * x + s.u_axis.y() * y + s.u_axis.z() * z;
  const float b = s.normal.x() * x + s.normal.y() * y + s.normal.z() * z;
  const float square = std::max(a * a + b * b, 1e-20f);
  const float closest = -(s.eye.x() * a + s.eye.z() * b) / square;
  const float p = s.eye.x() + closest * a;
  const float q = s.eye.z() + closest * b;
  const float root = (s.radius * s.radius - (p * p + q * q)) / square;
  const float t = closest - std::sqrt(std::max(root, 0.0f));
  const float v = s.eye.y() + t * (s.v_axis.x() * x + s.v_axis.y() * y + s.v_axis.z() * z);
  const float inside_v = lesser(v, s.size.y() - v) + kSeam;
  const float margin = lesser(lesser(inside_v, t), root);
  return margin > 0.0f ? t : kInfinity;
}

inline float hit_sphere(const TraceSurface& s, float x, float y, float z) {
  const Vector3f& c = s.bounding_centre;
  const float square = x * x + y * y + z * z;
  const float closest = (c.x() * x + c.y() * y + c.z() * z) / square;
  const float p = closest * x - c.x();
  const float q = closest * y - c.y();
  const float r = closest * z - c.z();
  const float root = (s.radius * s.radius - (p * p + q * q + r * r)) / square;
  const float t = closest - std::sqrt(std::max(root, 0.0f));
  return lesser(root, t) > 0.0f ? t : kInfinity;
}

float hit_any(const TraceSurface& s, const Vector3f& d) {
  switch (s.kind) {
    case SurfaceKind::kRectangle:
      return hit_rectangle(s, d.x(), d.y(), d.z());
    case SurfaceKind::kDisc:
      return hit_disc(s, d.x(), d.y(), d.z());
    case SurfaceKind::kCylinder:
      return hit_cylinder(s, d.x(), d.y(), d.z());
    case SurfaceKind::kSphere:
      return hit_sphere(s, d.x(), d.y(), d.z());
  }
  return kInfinity;
}

/// hit: one of the functions above, a template argument so that it gets inlined.
template <float (*hit)(const TraceSurface&, float, float, float)>
void trace_all(const TraceSurface& surface_in, std::int32_t id, RayTile& tile) {
  const TraceSurface surface = surface_in;  // A copy cannot alias what the loop writes.
  std::array<float, RayTile::kCapacity> found;
  for (int i = 0; i < tile.count; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    found[k] = hit(surface, tile.x[k], tile.y[k], tile.z[k]);
  }
  for (int i = 0; i < tile.count; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    const std::int32_t is_nearer = -static_cast<std::int32_t>(found[k] < tile.distance[k]);
    tile.hit[k] = (id & is_nearer) | (tile.hit[k] & ~is_nearer);
    tile.distance[k] = lesser(found[k], tile.distance[k]);
  }
}

/// By SurfaceKind.
constexpr std::array kTraceAll = {
    trace_all<hit_rectangle>, trace_all<hit_disc>, trace_all<hit_cylinder>, trace_all<hit_sphere>};

/// The cone around the rays of a tile.
struct Cone {
  Vector3f axis = Vector3f::Zero();
  float cos_half = -1.0f;
  float sin_half = 0.0f;

  explicit Cone(const RayTile& tile) {
    for (int i = 0; i < tile.count; ++i) {
      if (tile.hit[static_cast<std::size_t>(i)] != RayTile::kNoRay) {
        axis += tile.direction(i).normalized();
      }
    }
    if (axis.norm() < 1e-3f) return;
    axis.normalize();
    cos_half = 1.0f;
    for (int i = 0; i < tile.count; ++i) {
      if (tile.hit[static_cast<std::size_t>(i)] == RayTile::kNoRay) continue;
      cos_half = std::min(cos_half, axis.dot(tile.direction(i).normalized()));
    }
    cos_half -= 1e-5f;
    sin_half = std::sqrt(std::max(0.0f, 1.0f - cos_half * cos_half));
  }

  bool may_touch(const TraceSurface& s) const {
    const float distance = s.bounding_centre.norm();
    if (cos_half <= 0.0f || distance <= s.bounding_radius) return true;
    const float sin_size = s.bounding_radius / distance;
    const float cos_size = std::sqrt(1.0f - sin_size * sin_size);
    // Both angles are below 90 degrees: beyond their sum nothing touches.
    const float cos_sum = cos_half * cos_size - sin_half * sin_size;
    return axis.dot(s.bounding_centre) >= cos_sum * distance;
  }
};

TraceSurface relative_to(const Surface& surface, std::uint32_t index, const Vector3d& eye) {
  const Vector3d normal = surface.normal();
  const Vector3d offset = eye - surface.origin;
  const Vector3d local(surface.u_axis.dot(offset), surface.v_axis.dot(offset), normal.dot(offset));
  TraceSurface s;
  s.kind = surface.kind;
  s.index = index;
  s.u_axis = surface.u_axis.cast<float>();
  s.v_axis = surface.v_axis.cast<float>();
  s.normal = normal.cast<float>();
  s.eye = local.cast<float>();
  s.size = surface.size.cast<float>();
  s.radius = static_cast<float>(surface.radius);

  Vector3d middle(0.5 * surface.size.x(), 0.5 * surface.size.y(), 0.0);
  Vector3d half = middle;
  if (is_round(surface.kind)) {
    const bool is_sphere = surface.kind == SurfaceKind::kSphere;
    half = Vector3d(surface.radius, is_sphere ? surface.radius : middle.y(), surface.radius);
    middle = Vector3d(0.0, is_sphere ? 0.0 : middle.y(), 0.0);
  }
  const double bounding = surface.kind == SurfaceKind::kSphere ? surface.radius : half.norm();
  s.bounding_radius = static_cast<float>(bounding + 2.0 * kSeamM);
  s.bounding_centre =
      (surface.origin + surface.u_axis * middle.x() + surface.v_axis * middle.y() - eye)
          .cast<float>();
  // Distance of the eye from the box around the surface, in its axes.
  const Vector3d outside = ((local - middle).cwiseAbs() - half).cwiseMax(0.0);
  s.nearest = static_cast<float>(0.999 * outside.norm());
  return s;
}

}  // namespace

void RayTile::add(const Vector3f& direction) {
  const std::size_t k = static_cast<std::size_t>(count++);
  const bool is_ray = !direction.isZero();
  x[k] = direction.x();
  y[k] = direction.y();
  z[k] = is_ray ? direction.z() : 1.0f;
  distance[k] = is_ray ? kInfinity : -1.0f;
  hit[k] = is_ray ? kSky : kNoRay;
}

Vector2f TraceSurface::uv(const Vector3f& direction, float distance) const {
  const Vector3f point =
      eye +
      distance * Vector3f(u_axis.dot(direction), v_axis.dot(direction), normal.dot(direction));
  if (!is_round(kind)) return point.head<2>();
  float angle = std::atan2(-point.z(), point.x());
  if (angle < 0.0f) angle += 2.0f * std::numbers::pi_v<float>;
  if (kind == SurfaceKind::kCylinder) return {radius * angle, point.y()};
  return {radius * angle, radius * std::atan2(std::hypot(point.x(), point.z()), -point.y())};
}

float TraceSurface::distance_along(const Vector3f& direction) const {
  if (is_round(kind)) return hit_any(*this, direction);
  const float across = normal.dot(direction);
  return across < 0.0f ? -eye.z() / across : kInfinity;
}

Tracer::Tracer(std::span<const Surface> surfaces, const Vector3d& eye) {
  for (std::uint32_t i = 0; i < surfaces.size(); ++i) {
    const TraceSurface surface = relative_to(surfaces[i], i, eye);
    if (is_round(surface.kind) || surface.eye.z() > 0.0f) surfaces_.push_back(surface);
  }
  std::stable_sort(surfaces_.begin(), surfaces_.end(), [](const auto& a, const auto& b) {
    return a.nearest < b.nearest;
  });
}

void Tracer::trace(RayTile& tile) const {
  const Cone cone(tile);
  float longest = 0.0f;  // Of the directions, as distances count in multiples of them.
  for (int i = 0; i < tile.count; ++i) longest = std::max(longest, tile.direction(i).norm());
  float farthest = kInfinity;
  for (std::size_t k = 0; k < surfaces_.size() && surfaces_[k].nearest <= farthest; ++k) {
    const TraceSurface& surface = surfaces_[k];
    if (!cone.may_touch(surface)) continue;
    kTraceAll[static_cast<std::size_t>(surface.kind)](surface, static_cast<std::int32_t>(k), tile);
    const auto end = tile.distance.begin() + tile.count;
    farthest = longest * *std::max_element(tile.distance.begin(), end);
  }
}

void Tracer::candidates(const RayTile& tile, std::vector<std::int32_t>& result) const {
  const Cone cone(tile);
  result.clear();
  for (std::size_t k = 0; k < surfaces_.size(); ++k) {
    if (cone.may_touch(surfaces_[k])) result.push_back(static_cast<std::int32_t>(k));
  }
}

std::int32_t Tracer::trace_one(const Vector3f& direction,
                               const std::vector<std::int32_t>& candidates,
                               float& distance) const {
  const float length = direction.norm();
  std::int32_t nearest = RayTile::kSky;
  distance = kInfinity;
  for (const std::int32_t id : candidates) {
    const TraceSurface& candidate = surface(id);
    if (candidate.nearest > distance * length) break;
    const float t = hit_any(candidate, direction);
    if (t < distance) {
      distance = t;
      nearest = id;
    }
  }
  return nearest;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/surface.h"

#include <cmath>
#include <numbers>

namespace waymark {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFullTurn = 2.0 * std::numbers::pi;

/// The ray in the surface's axes (u, v, normal), relative to its origin.
struct LocalRay {
  Vector3d origin;
  Vector3d direction;
};

LocalRay to_local(const Surface& surface, const Vector3d& origin, const Vector3d& direction) {
  const Vector3d normal = surface.normal();
  const Vector3d offset = origin - surface.origin;
  return {{surface.u_axis.dot(offset), surface.v_axis.dot(offset), normal.dot(offset)},
          {surface.u_axis.dot(direction), surface.v_axis.dot(direction), normal.dot(direction)}};
}

double angle_of(double x, double y) {
  const double angle = std::atan2(y, x);
  return angle < 0.0 ? angle + kFullTurn : angle;
}

std::optional<SurfaceHit> intersect_plane(const Surface& surface, const LocalRay& ray) {
  if (ray.direction.z() >= 0.0 || ray.origin.z() <= 0.0) return std::nullopt;
  const double distance = -ray.origin.z() / ray.direction.z();
  const Vector2d uv = (ray.origin + distance * ray.direction).head<2>();
  if (surface.kind == SurfaceKind::kDisc) {
    const Vector2d centre(surface.radius, surface.radius);
    if ((uv - centre).norm() > surface.radius) return std::nullopt;
  } else if ((uv.array() < -kSeamM).any() || (uv.array() > surface.size.array() + kSeamM).any()) {
    return std::nullopt;
  }
  return SurfaceHit{distance, uv, surface.normal()};
}

std::optional<SurfaceHit> intersect_cylinder(const Surface& surface, const LocalRay& ray) {
  const Vector2d across(ray.direction.x(), ray.direction.z());
  const Vector2d offset(ray.origin.x(), ray.origin.z());
  const double square = across.squaredNorm();
  if (square <= 0.0) return std::nullopt;
  const double closest = -offset.dot(across) / square;
  const double root =
      (surface.radius * surface.radius - (offset + closest * across).squaredNorm()) / square;
  if (root < 0.0) return std::nullopt;
  const double distance = closest - std::sqrt(root);
  if (distance <= 0.0) return std::nullopt;
  const Vector3d point = ray.origin + distance * ray.direction;
  if (point.y() < -kSeamM || point.y() > surface.size.y() + kSeamM) return std::nullopt;
  const Vector2d uv(surface.radius * angle_of(point.x(), -point.z()), point.y());
  return SurfaceHit{distance, uv, surface_normal(surface, uv)};
}

std::optional<SurfaceHit> intersect_sphere(const Surface& surface, const LocalRay& ray) {
  const double square = ray.direction.squaredNorm();
  const double closest = -ray.origin.dot(ray.direction) / square;
  const double root =
      (surface.radius * surface.radius - (ray.origin + closest * ray.direction).squaredNorm()) /
      square;
  if (root < 0.0) return std::nullopt;
  const double distance = closest - std::sqrt(root);
  if (distance <= 0.0) return std::nullopt;
  const Vector3d point = ray.origin + distance * ray.direction;
  const double polar = std::atan2(std::hypot(point.x(), point.z()), -point.y());
  const Vector2d uv(surface.radius * angle_of(point.x(), -point.z()), surface.radius * polar);
  return SurfaceHit{distance, uv, surface_normal(surface, uv)};
}

}  // namespace

Surface make_rectangle(const Vector3d& corner,
                       const Vector3d& u_axis,
                       const Vector3d& v_axis,
                       const Vector2d& size) {
  Surface surface;
  surface.origin = corner;
  surface.u_axis = u_axis;
  surface.v_axis = v_axis;
  surface.size = size;
  return surface;
}

Surface make_disc(const Vector3d& centre, const Vector3d& normal, double radius) {
  Surface surface;
  surface.kind = SurfaceKind::kDisc;
  surface.u_axis = (std::abs(normal.x()) < 0.9 ? Vector3d::UnitX() : Vector3d::UnitY());
  surface.u_axis = (surface.u_axis - normal * normal.dot(surface.u_axis)).normalized();
  surface.v_axis = surface.u_axis.cross(normal);
  surface.origin = centre - radius * (surface.u_axis + surface.v_axis);
  surface.size = Vector2d::Constant(2.0 * radius);
  surface.radius = radius;
  return surface;
}

Surface make_cylinder(const Vector3d& base_centre, double radius, double height) {
  Surface surface;
  surface.kind = SurfaceKind::kCylinder;
  surface.origin = base_centre + height * Vector3d::UnitZ();
  surface.size = {kFullTurn * radius, height};
  surface.radius = radius;
  return surface;
}

Surface make_sphere(const Vector3d& centre, double radius) {
  Surface surface;
  surface.kind = SurfaceKind::kSphere;
  surface.origin = centre;
  surface.size = {kFullTurn * radius, std::numbers::pi * radius};
  surface.radius = radius;
  return surface;
}

std::optional<SurfaceHit> intersect(const Surface& surface,
                                    const Vector3d& origin,
                                    const Vector3d& direction) {
  const LocalRay ray = to_local(surface, origin, direction);
  switch (surface.kind) {
    case SurfaceKind::kRectangle:
    case SurfaceKind::kDisc:
      return intersect_plane(surface, ray);
    case SurfaceKind::kCylinder:
      return intersect_cylinder(surface, ray);
    case SurfaceKind::kSphere:
      return intersect_sphere(surface, ray);
  }
  return std::nullopt;
}

Vector3d surface_normal(const Surface& surface, const Vector2d& uv) {
  if (surface.kind == SurfaceKind::kRectangle || surface.kind == SurfaceKind::kDisc) {
    return surface.normal();
  }
  const double angle = uv.x() / surface.radius;
  const Vector3d around = std::cos(angle) * surface.u_axis - std::sin(angle) * surface.normal();
  if (surface.kind == SurfaceKind::kCylinder) return around;
  const double polar = uv.y() / surface.radius;
  return std::sin(polar) * around - std::cos(polar) * surface.v_axis;
}

Vector3d surface_point(const Surface& surface, const Vector2d& uv) {
  switch (surface.kind) {
    case SurfaceKind::kRectangle:
    case SurfaceKind::kDisc:
      return surface.origin + uv.x() * surface.u_axis + uv.y() * surface.v_axis;
    case SurfaceKind::kCylinder:
      return surface.origin + surface.radius * surface_normal(surface, uv) +
             uv.y() * surface.v_axis;
    case SurfaceKind::kSphere:
      return surface.origin + surface.radius * surface_normal(surface, uv);
  }
  return surface.origin;
}

}  // namespace waymark

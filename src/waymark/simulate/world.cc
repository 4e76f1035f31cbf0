// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/world.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "waymark/base/check.h"

namespace waymark {
namespace {

/// Places read along a long footprint at most; longer ones get blurred.
constexpr int kMaxProbes = 6;

Image half(const Image& image) {
  Image result((image.width_px + 1) / 2, (image.height_px + 1) / 2);
  for (int y = 0; y < result.height_px; ++y) {
    const std::uint8_t* top = image.row(2 * y);
    const std::uint8_t* bottom = image.row(std::min(2 * y + 1, image.height_px - 1));
    std::uint8_t* out = result.row(y);
    for (int x = 0; x < result.width_px; ++x) {
      const int right = std::min(2 * x + 1, image.width_px - 1);
      // Rounding alternates, so that coarse levels neither darken nor brighten.
      const int sum = top[2 * x] + top[right] + bottom[2 * x] + bottom[right];
      out[x] = static_cast<std::uint8_t>((sum + 1 + ((x + y) & 1)) / 4);
    }
  }
  return result;
}

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

/// A cylinder or sphere.
std::optional<SurfaceHit> intersect_round(const Surface& surface, const LocalRay& ray) {
  const bool is_sphere = surface.kind == SurfaceKind::kSphere;
  // What lies along the axis of a cylinder does not count.
  const Vector3d counts(1.0, is_sphere ? 1.0 : 0.0, 1.0);
  const Vector3d across = counts.cwiseProduct(ray.direction);
  const Vector3d offset = counts.cwiseProduct(ray.origin);
  const double square = across.squaredNorm();
  if (square <= 0.0) return std::nullopt;
  const double closest = -offset.dot(across) / square;
  const double root =
      (surface.radius * surface.radius - (offset + closest * across).squaredNorm()) / square;
  if (root < 0.0) return std::nullopt;
  const double distance = closest - std::sqrt(root);
  if (distance <= 0.0) return std::nullopt;
  const Vector3d point = ray.origin + distance * ray.direction;
  Vector2d uv(surface.radius * angle_of(point.x(), -point.z()), point.y());
  if (is_sphere) {
    uv.y() = surface.radius * std::atan2(std::hypot(point.x(), point.z()), -point.y());
  } else if (uv.y() < -kSeamM || uv.y() > surface.size.y() + kSeamM) {
    return std::nullopt;
  }
  return SurfaceHit{distance, uv, surface_normal(surface, uv)};
}

}  // namespace

Texture::Texture(Image base, double texel_m, bool wraps_u)
    : texel_m_(texel_m), texels_per_metre_(static_cast<float>(1.0 / texel_m)), wraps_u_(wraps_u) {
  WAYMARK_CHECK(base.width_px > 0 && base.height_px > 0 && texel_m > 0.0);
  levels_.push_back(std::move(base));
  while (levels_.back().width_px > 1 || levels_.back().height_px > 1) {
    levels_.push_back(half(levels_.back()));
  }
}

float Texture::sample(const Eigen::Vector2f& centre_m,
                      const Eigen::Vector2f& edge_a_m,
                      const Eigen::Vector2f& edge_b_m) const {
  Eigen::Vector2f longer = edge_a_m * texels_per_metre_;
  const Eigen::Vector2f other = edge_b_m * texels_per_metre_;
  const float area = std::abs(longer.x() * other.y() - longer.y() * other.x());
  if (other.squaredNorm() > longer.squaredNorm()) longer = other;
  const float length = longer.norm();
  const float height = std::max({area / std::max(length, 1e-6f), length / kMaxProbes, 1.0f});
  const int num_probes =
      std::clamp(static_cast<int>(std::ceil(length / height - 0.25f)), 1, kMaxProbes);

  const int last = static_cast<int>(levels_.size()) - 1;
  const float lod = std::min(std::log2(height), static_cast<float>(last));
  const int level = std::min(static_cast<int>(lod), std::max(last - 1, 0));
  const float fraction = last == 0 ? 0.0f : lod - static_cast<float>(level);

  Probes probes;
  probes.count = num_probes;
  probes.step = longer / static_cast<float>(num_probes);
  probes.first =
      centre_m * texels_per_metre_ - probes.step * (0.5f * static_cast<float>(num_probes - 1));
  const float fine = wraps_u_ ? mean<true>(level, probes) : mean<false>(level, probes);
  if (fraction <= 0.0f) return fine;
  const float coarse = wraps_u_ ? mean<true>(level + 1, probes) : mean<false>(level + 1, probes);
  return fine + fraction * (coarse - fine);
}

template <bool kWraps>
float Texture::mean(int level, const Probes& probes) const {
  const Image& image = levels_[static_cast<std::size_t>(level)];
  const float scale = 1.0f / static_cast<float>(1 << level);
  const float width = static_cast<float>(image.width_px);
  const float last_column = width - 1.0f;
  const float last_row = static_cast<float>(image.height_px - 1);
  const Eigen::Vector2f step = probes.step * scale;
  float x = probes.first.x() * scale - 0.5f;
  float y = probes.first.y() * scale - 0.5f;
  float sum = 0.0f;
  for (int k = 0; k < probes.count; ++k, x += step.x(), y += step.y()) {
    float column = x;
    if constexpr (kWraps) column = std::max(0.0f, column - width * std::floor(column / width));
    if constexpr (!kWraps) column = std::min(std::max(column, 0.0f), last_column);
    const float row = std::min(std::max(y, 0.0f), last_row);
    const int x0 = std::min(static_cast<int>(column), image.width_px - 1);
    const int y0 = static_cast<int>(row);
    const int is_inside = column < last_column ? 1 : 0;
    const int x1 = kWraps && is_inside == 0 ? 0 : x0 + is_inside;
    const float right = column - static_cast<float>(x0);
    const std::uint8_t* top = image.row(y0);
    const std::uint8_t* bottom = top + (row < last_row ? image.width_px : 0);
    const float upper = top[x0] + right * static_cast<float>(top[x1] - top[x0]);
    const float lower = bottom[x0] + right * static_cast<float>(bottom[x1] - bottom[x0]);
    sum += upper + (row - static_cast<float>(y0)) * (lower - upper);
  }
  return sum / static_cast<float>(probes.count);
}

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
  return is_round(surface.kind) ? intersect_round(surface, ray) : intersect_plane(surface, ray);
}

Vector3d surface_normal(const Surface& surface, const Vector2d& uv) {
  if (!is_round(surface.kind)) return surface.normal();
  const double angle = uv.x() / surface.radius;
  const Vector3d around = std::cos(angle) * surface.u_axis - std::sin(angle) * surface.normal();
  if (surface.kind == SurfaceKind::kCylinder) return around;
  const double polar = uv.y() / surface.radius;
  return std::sin(polar) * around - std::cos(polar) * surface.v_axis;
}

Vector3d surface_point(const Surface& surface, const Vector2d& uv) {
  if (!is_round(surface.kind)) {
    return surface.origin + uv.x() * surface.u_axis + uv.y() * surface.v_axis;
  }
  const Vector3d point = surface.origin + surface.radius * surface_normal(surface, uv);
  if (surface.kind == SurfaceKind::kSphere) return point;
  return point + uv.y() * surface.v_axis;
}

std::vector<Surface> World::surfaces_at(double time_s) const {
  const Vector3d nowhere(0.0, 0.0, -1e6);
  std::vector<Surface> moved = surfaces;
  for (const Pedestrian& walk : walks) {
    const bool is_there = time_s >= walk.start_s && time_s < walk.end_s;
    const Vector3d at =
        is_there ? Vector3d(walk.start + (time_s - walk.start_s) * walk.velocity) : nowhere;
    for (std::uint32_t i = walk.first_surface; i < walk.end_surface; ++i) moved[i].origin += at;
  }
  for (const DynamicObject& part : carried) {
    const Rigid3 world_from_part = part.world_from_part(time_s);
    for (std::uint32_t i = part.first_surface; i < part.end_surface; ++i) {
      moved[i].origin = world_from_part * moved[i].origin;
      moved[i].u_axis = world_from_part.rotation * moved[i].u_axis;
      moved[i].v_axis = world_from_part.rotation * moved[i].v_axis;
    }
  }
  return moved;
}

std::optional<WorldHit> World::intersect(const Eigen::Vector3d& origin,
                                         const Eigen::Vector3d& direction) const {
  std::optional<WorldHit> nearest;
  for (std::uint32_t i = 0; i < surfaces.size(); ++i) {
    const std::optional<SurfaceHit> hit = waymark::intersect(surfaces[i], origin, direction);
    if (hit && (!nearest || hit->distance < nearest->hit.distance)) nearest = WorldHit{i, *hit};
  }
  return nearest;
}

}  // namespace waymark

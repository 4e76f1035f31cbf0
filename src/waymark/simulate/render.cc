// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/render.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "waymark/simulate/tracer.h"

namespace waymark {
namespace {

/// Zero mean, unit variance, from two draws of 64 bits: eight numbers of 16 bits.
double fast_normal(Rng& rng) {
  double sum = 0.0;
  for (int draw = 0; draw < 2; ++draw) {
    const std::uint64_t bits = rng.next();
    sum += static_cast<double>((bits & 0xFFFF) + ((bits >> 16) & 0xFFFF) + ((bits >> 32) & 0xFFFF) +
                               (bits >> 48));
  }
  constexpr double kMean = 8.0 * 65535.0 / 2.0;
  // The variance of a uniform number of n values is (n^2 - 1) / 12.
  static const double kScale = 1.0 / std::sqrt(8.0 * (65536.0 * 65536.0 - 1.0) / 12.0);
  return (sum - kMean) * kScale;
}

using Eigen::Vector2d;
using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kTileWidth = 32;
constexpr int kTileHeight = 16;
static_assert((kTileWidth + 1) * (kTileHeight + 1) <= RayTile::kCapacity);

/// Rays per side of a pixel with an edge in it.
constexpr int kSubRays = 3;

/// Bearings of the pixels (x + offset, y + offset); 0 where there is none.
std::vector<Vector3d> tabulate(
    const Camera& camera, const RectificationError& error, int width, int height, double offset) {
  std::vector<Vector2d> pixels;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) pixels.emplace_back(x + offset, y + offset);
  }
  std::vector<Vector3d> bearings(pixels.size());
  std::vector<std::uint8_t> is_valid(pixels.size());
  camera.unproject(pixels, bearings, is_valid);
  for (std::size_t i = 0; i < bearings.size(); ++i) {
    bearings[i] = is_valid[i] ? error.true_bearing(bearings[i]) : Vector3d(Vector3d::Zero());
  }
  return bearings;
}

/// Share of light that a surface with this outward normal sends to the eye, whatever the view.
float light_on(const Vector3f& normal) {
  const Vector3f towards_light = Vector3f(0.35f, -0.5f, 0.8f).normalized();
  return 0.82f + 0.18f * normal.dot(towards_light);
}

float sky_grey(const Vector3f& direction) {
  const Vector3f d = direction.normalized();
  const float clouds =
      std::sin(5.0f * d.x() + 2.0f * d.z()) + std::sin(4.0f * d.y() - 3.0f * d.z());
  return 215.0f + 25.0f * d.z() + 6.0f * clouds;
}

/// Brings u within half a turn of reference.
float unwrap(float u, float reference, const TraceSurface& s) {
  if (!is_round(s.kind)) return u;
  return u - s.size.x() * std::round((u - reference) / s.size.x());
}

std::uint8_t nearest_grey(float value) {
  return static_cast<std::uint8_t>(std::clamp(value + 0.5f, 0.0f, 255.0f));
}

/// The four corners of a pixel, left to right, then top to bottom.
using Corners = std::array<int, 4>;

class TileShader {
 public:
  TileShader(const World& world, const Tracer& tracer, const RayTile& rays)
      : world_(world), tracer_(tracer), rays_(rays) {
    for (int i = 0; i < rays.count; ++i) {
      const std::size_t k = static_cast<std::size_t>(i);
      if (rays.hit[k] >= 0) {
        uv_[k] = tracer.surface(rays.hit[k]).uv(rays.direction(i), rays.distance[k]);
      }
    }
  }

  std::uint8_t pixel(const Corners& corners) {
    const std::int32_t hit = rays_.hit[static_cast<std::size_t>(corners[0])];
    bool is_uniform = true;
    for (const int corner : corners) {
      const std::int32_t other = rays_.hit[static_cast<std::size_t>(corner)];
      if (other == RayTile::kNoRay) return 0;
      is_uniform = is_uniform && other == hit;
    }
    if (!is_uniform) return nearest_grey(many_rays(corners));
    if (hit == RayTile::kSky) return nearest_grey(sky_grey(rays_.direction(corners[0])));
    return nearest_grey(one_surface(tracer_.surface(hit), corners));
  }

 private:
  float grey(const TraceSurface& s,
             const Vector2f& uv,
             const Vector2f& a,
             const Vector2f& b) const {
    const Surface& surface = world_.surfaces[s.index];
    const Vector3f normal = is_round(s.kind)
                                ? Vector3f(surface_normal(surface, uv.cast<double>()).cast<float>())
                                : s.normal;
    return light_on(normal) * world_.textures[surface.texture].sample(uv, a, b);
  }

  float one_surface(const TraceSurface& s, const Corners& corners) const {
    std::array<Vector2f, 4> uv;
    for (std::size_t i = 0; i < 4; ++i) {
      uv[i] = uv_[static_cast<std::size_t>(corners[i])];
      uv[i].x() = unwrap(uv[i].x(), uv[0].x(), s);
    }
    const Vector2f centre = 0.25f * (uv[0] + uv[1] + uv[2] + uv[3]);
    const Vector2f right = 0.5f * (uv[1] + uv[3] - uv[0] - uv[2]);
    const Vector2f down = 0.5f * (uv[2] + uv[3] - uv[0] - uv[1]);
    return grey(s, centre, right, down);
  }

  /// The footprint's edge from uv when the ray moves by step; none where it leaves the surface.
  static Vector2f edge(const TraceSurface& s, const Vector2f& uv, const Vector3f& moved) {
    const float distance = s.distance_along(moved);
    if (!std::isfinite(distance)) return Vector2f::Zero();
    Vector2f end = s.uv(moved, distance);
    end.x() = unwrap(end.x(), uv.x(), s);
    return end - uv;
  }

  float many_rays(const Corners& corners) {
    if (candidates_.empty()) tracer_.candidates(rays_, candidates_);
    std::array<Vector3f, 4> d;
    for (std::size_t i = 0; i < 4; ++i) d[i] = rays_.direction(corners[i]);
    constexpr float kStep = 1.0f / kSubRays;
    float sum = 0.0f;
    for (int k = 0; k < kSubRays * kSubRays; ++k) {
      const float x = (static_cast<float>(k % kSubRays) + 0.5f) * kStep;
      const float y = (static_cast<float>(k / kSubRays) + 0.5f) * kStep;
      const Vector3f right = (1.0f - y) * (d[1] - d[0]) + y * (d[3] - d[2]);
      const Vector3f down = (1.0f - x) * (d[2] - d[0]) + x * (d[3] - d[1]);
      const Vector3f ray = (1.0f - y) * d[0] + y * d[2] + x * right;
      float distance = 0.0f;
      const std::int32_t hit = tracer_.trace_one(ray, candidates_, distance);
      if (hit == RayTile::kSky) {
        sum += sky_grey(ray);
        continue;
      }
      const TraceSurface& s = tracer_.surface(hit);
      const Vector2f uv = s.uv(ray, distance);
      sum += grey(s, uv, edge(s, uv, ray + kStep * right), edge(s, uv, ray + kStep * down));
    }
    return sum * (kStep * kStep);
  }

  const World& world_;
  const Tracer& tracer_;
  const RayTile& rays_;
  std::array<Vector2f, RayTile::kCapacity> uv_;
  std::vector<std::int32_t> candidates_;
};

}  // namespace

void apply_exposure(const ImageEffects& effects, Rng& rng, Image& image) {
  if (effects.gain == 1.0 && effects.noise_sigma <= 0.0) return;
  for (std::uint8_t& value : image.values) {
    double grey = effects.gain * value;
    if (effects.noise_sigma > 0.0) grey += effects.noise_sigma * fast_normal(rng);
    value = static_cast<std::uint8_t>(std::clamp(grey + 0.5, 0.0, 255.0));
  }
}

void apply_depth_noise(const ImageEffects& effects,
                       double units_per_metre,
                       Rng& rng,
                       DepthImage& depth) {
  if (effects.inverse_depth_sigma <= 0.0) return;
  for (std::uint16_t& value : depth.values) {
    if (value == 0) continue;
    const double inverse = units_per_metre / value + effects.inverse_depth_sigma * fast_normal(rng);
    const double units = std::round(units_per_metre / inverse);
    value = units > 0.0 && units <= 65535.0 ? static_cast<std::uint16_t>(units) : std::uint16_t{0};
  }
}

/// What is the same for all tiles of an image.
struct Renderer::View {
  View(std::span<const Surface> surfaces_in, const Rigid3& world_from_cam)
      : pose(world_from_cam),
        surfaces(surfaces_in),
        tracer(surfaces_in, world_from_cam.translation) {}

  Rigid3 pose;
  std::span<const Surface> surfaces;
  Tracer tracer;
  double units_per_metre = 0.0;
};

struct Renderer::Tile {
  int x0, y0, x1, y1;
};

Renderer::Renderer(std::shared_ptr<const World> world,
                   std::shared_ptr<const Camera> camera,
                   const RectificationError& error)
    : world_(std::move(world)), camera_(std::move(camera)) {
  const int width = camera_->width_px();
  const int height = camera_->height_px();
  for (const Vector3d& bearing : tabulate(*camera_, error, width + 1, height + 1, -0.5)) {
    corner_bearings_.push_back(bearing.cast<float>());
  }
  centre_bearings_ = tabulate(*camera_, error, width, height, 0.0);
}

double Renderer::pixel_rad() const {
  const std::size_t width = static_cast<std::size_t>(camera_->width_px());
  const std::size_t middle = (centre_bearings_.size() / width / 2) * width + width / 2;
  const Vector3d& bearing = centre_bearings_[middle];
  return bearing.cross(centre_bearings_[middle - 1]).norm();
}

template <class Body>
void Renderer::for_tiles(ThreadPool& pool, int tile_height, Body body) const {
  const int width = camera_->width_px();
  const int height = camera_->height_px();
  const int rows = (height + tile_height - 1) / tile_height;
  pool.for_chunks(static_cast<std::size_t>(rows), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      const int y0 = static_cast<int>(row) * tile_height;
      for (int x0 = 0; x0 < width; x0 += kTileWidth) {
        body(Tile{x0, y0, std::min(x0 + kTileWidth, width), std::min(y0 + tile_height, height)});
      }
    }
  });
}

Image Renderer::image(const Rigid3& world_from_cam, ThreadPool& pool, double time_s) const {
  Image result(camera_->width_px(), camera_->height_px());
  const std::vector<Surface> surfaces = world_->surfaces_at(time_s);
  const View view(surfaces, world_from_cam);
  for_tiles(pool, kTileHeight, [&](const Tile& tile) { shade_tile(view, tile, result); });
  return result;
}

Image Renderer::rolling_image(const std::function<Rigid3(int row)>& world_from_cam,
                              ThreadPool& pool,
                              double time_s) const {
  Image result(camera_->width_px(), camera_->height_px());
  const std::vector<Surface> surfaces = world_->surfaces_at(time_s);
  std::vector<View> views;
  for (int row = 0; row < result.height_px; ++row) {
    views.emplace_back(surfaces, world_from_cam(row));
  }
  for_tiles(pool, 1, [&](const Tile& tile) {
    shade_tile(views[static_cast<std::size_t>(tile.y0)], tile, result);
  });
  return result;
}

DepthImage Renderer::depth(const Rigid3& world_from_cam,
                           double units_per_metre,
                           ThreadPool& pool,
                           double time_s) const {
  DepthImage result(camera_->width_px(), camera_->height_px());
  const std::vector<Surface> surfaces = world_->surfaces_at(time_s);
  View view(surfaces, world_from_cam);
  view.units_per_metre = units_per_metre;
  for_tiles(pool, kTileHeight, [&](const Tile& tile) { measure_tile(view, tile, result); });
  return result;
}

void Renderer::shade_tile(const View& view, const Tile& tile, Image& result) const {
  const Eigen::Matrix3f world_from_cam = view.pose.rotation_matrix().cast<float>();
  RayTile rays;
  for (int y = tile.y0; y <= tile.y1; ++y) {
    for (int x = tile.x0; x <= tile.x1; ++x) {
      const std::size_t at =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_->width_px() + 1) +
          static_cast<std::size_t>(x);
      rays.add(world_from_cam * corner_bearings_[at]);
    }
  }
  view.tracer.trace(rays);
  TileShader shader(*world_, view.tracer, rays);
  const int stride = tile.x1 - tile.x0 + 1;
  for (int y = tile.y0; y < tile.y1; ++y) {
    for (int x = tile.x0; x < tile.x1; ++x) {
      const int first = (y - tile.y0) * stride + x - tile.x0;
      result.row(y)[x] = shader.pixel({first, first + 1, first + stride, first + stride + 1});
    }
  }
}

void Renderer::measure_tile(const View& view, const Tile& tile, DepthImage& result) const {
  const Eigen::Matrix3d world_from_cam = view.pose.rotation_matrix();
  const auto bearing_at = [&](int x, int y) -> const Vector3d& {
    return centre_bearings_[static_cast<std::size_t>(y) *
                                static_cast<std::size_t>(camera_->width_px()) +
                            static_cast<std::size_t>(x)];
  };
  RayTile rays;
  for (int y = tile.y0; y < tile.y1; ++y) {
    for (int x = tile.x0; x < tile.x1; ++x) {
      rays.add((world_from_cam * bearing_at(x, y)).cast<float>());
    }
  }
  view.tracer.trace(rays);
  std::size_t k = 0;
  for (int y = tile.y0; y < tile.y1; ++y) {
    for (int x = tile.x0; x < tile.x1; ++x, ++k) {
      if (rays.hit[k] < 0) continue;
      const Vector3d& bearing = bearing_at(x, y);
      const Vector3d direction = world_from_cam * bearing;
      const Surface& surface = view.surfaces[view.tracer.surface(rays.hit[k]).index];
      const std::optional<SurfaceHit> hit = intersect(surface, view.pose.translation, direction);
      // At an outline single precision may hit what the exact ray just misses.
      const double distance = hit ? hit->distance : static_cast<double>(rays.distance[k]);
      const double units = std::round(distance * bearing.z() * view.units_per_metre);
      if (units > 0.0 && units <= 65535.0) result.row(y)[x] = static_cast<std::uint16_t>(units);
    }
  }
}

}  // namespace waymark

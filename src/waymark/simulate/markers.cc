// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/markers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"
#include "waymark/marker/family.h"

namespace waymark {
namespace {

using Eigen::Vector3d;

constexpr const char* kFamily = "tag36h11";
/// In texels of the world, which are the coarser the larger it is.
constexpr double kSideTexels = 50.0;
constexpr int kTexelsPerModule = 6;
constexpr double kQuietModules = 1.0;  ///< White around it.
constexpr double kLiftShare = 0.01;    ///< Before the surface, by the side.
constexpr int kMaxDraws = 400;
constexpr double kMaxTurnRad = 0.6;  ///< Of the ray that finds a place, from straight ahead.
constexpr double kFarSides = 15.0;   ///< From here on it is too small to count as seen.
constexpr double kMinCosine = 0.5;   ///< Seen from at most 60 degrees aside.
constexpr double kMinAhead = 0.8;    ///< Cosine of the half angle of view that counts.
constexpr double kApartSides = 4.0;
constexpr int kNumLooks = 60;  ///< Poses of the way that it is looked for from.

struct MarkerPlace {
  Rigid3 world_from_marker;
  int num_seen = 0;
};

/// Places for markers along a way.
class Markers {
 public:
  Markers(const Motion& motion, std::uint64_t seed, const World& world)
      : motion_(motion), world_(world), rng_(seed, 4) {
    side_ = kSideTexels * world.textures.front().texel_m();
  }

  double side() const { return side_; }

  /// The place that is seen most of those that a part of the way shows.
  std::optional<MarkerPlace> find(double begin_s, double end_s) {
    std::optional<MarkerPlace> best;
    for (int i = 0; i < kMaxDraws; ++i) {
      const auto place = draw(rng_.uniform(begin_s, end_s));
      if (place && (!best || place->num_seen > best->num_seen)) best = place;
    }
    if (best) taken_.push_back(best->world_from_marker.translation);
    return best;
  }

 private:
  std::optional<MarkerPlace> draw(double time_s) {
    const Rigid3 pose = motion_.world_from_rig(time_s);
    const double turn = rng_.uniform(-kMaxTurnRad, kMaxTurnRad);
    const double lift = rng_.uniform(-0.3 * kMaxTurnRad, 0.3 * kMaxTurnRad);
    const Vector3d ahead = pose.rotation * Vector3d(std::sin(turn), std::sin(lift), 1.0);
    const auto hit = world_.intersect(pose.translation, ahead);
    if (!hit) return std::nullopt;
    const Surface& surface = world_.surfaces[hit->surface];
    if (surface.kind != SurfaceKind::kRectangle || moves(hit->surface)) return std::nullopt;
    const double half = 0.5 * side_ * (1.0 + 2.0 * kQuietModules / 8.0);
    const Eigen::Vector2d& uv = hit->hit.uv;
    if ((uv.array() < half).any() || ((surface.size - uv).array() < half).any())
      return std::nullopt;
    MarkerPlace place;
    Eigen::Matrix3d axes;
    axes << surface.u_axis, -surface.v_axis, surface.normal();
    place.world_from_marker =
        Rigid3(Eigen::Quaterniond(axes),
               surface_point(surface, uv) + kLiftShare * side_ * surface.normal());
    if (!is_free(place)) return std::nullopt;
    for (int i = 0; i < kNumLooks; ++i) {
      place.num_seen += is_seen(place, (i + 0.5) / kNumLooks * motion_.duration_s());
    }
    return place;
  }

  bool moves(std::uint32_t surface) const {
    const auto holds = [surface](const auto& part) {
      return surface >= part.first_surface && surface < part.end_surface;
    };
    return std::ranges::any_of(world_.walks, holds) || std::ranges::any_of(world_.carried, holds);
  }

  /// Clear of the others, and with nothing before its corners.
  bool is_free(const MarkerPlace& place) const {
    for (const Vector3d& other : taken_) {
      if ((other - place.world_from_marker.translation).norm() < kApartSides * side_) return false;
    }
    return true;
  }

  bool is_seen(const MarkerPlace& place, double time_s) const {
    const Rigid3 pose = motion_.world_from_rig(time_s);
    const Vector3d ahead = pose.rotation * Vector3d::UnitZ();
    const Vector3d normal = place.world_from_marker.rotation * Vector3d::UnitZ();
    for (const double x : {-0.5, 0.5}) {
      for (const double y : {-0.5, 0.5}) {
        const Vector3d corner = place.world_from_marker * Vector3d(x * side_, y * side_, 0.0);
        const Vector3d way = corner - pose.translation;
        if (way.norm() > kFarSides * side_ || ahead.dot(way) < kMinAhead * way.norm()) return false;
        if (-normal.dot(way) < kMinCosine * way.norm()) return false;
        const auto hit = world_.intersect(pose.translation, way);
        if (hit && hit->hit.distance < 0.999) return false;
      }
    }
    return true;
  }

  const Motion& motion_;
  const World& world_;
  Rng rng_;
  double side_ = 0.0;
  std::vector<Vector3d> taken_;
};

Image print_marker(const MarkerFamily& family, int id) {
  const int count = family.side_modules();
  const int quiet = static_cast<int>(kQuietModules);
  const std::vector<std::uint8_t> modules = family.modules(id);
  const int width_px = (count + 2 * quiet) * kTexelsPerModule;
  Image image(width_px, width_px);
  for (int y = 0; y < width_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      const int column = x / kTexelsPerModule - quiet;
      const int row = y / kTexelsPerModule - quiet;
      const bool is_paper = column < 0 || row < 0 || column >= count || row >= count;
      const bool is_white =
          is_paper || modules[static_cast<std::size_t>(row * count + column)] != 0;
      image.row(y)[x] = is_white ? 215 : 25;
    }
  }
  return image;
}

void hang(const MarkerFamily& family, int id, const Rigid3& pose, double side, World& world) {
  const double module_m = side / family.side_modules();
  const double width_m = side + 2.0 * kQuietModules * module_m;
  const Vector3d u_axis = pose.rotation * Vector3d::UnitX();
  const Vector3d v_axis = pose.rotation * -Vector3d::UnitY();
  Surface surface = make_rectangle(pose.translation - 0.5 * width_m * (u_axis + v_axis),
                                   u_axis,
                                   v_axis,
                                   Eigen::Vector2d::Constant(width_m));
  surface.texture = static_cast<std::uint32_t>(world.textures.size());
  world.textures.emplace_back(print_marker(family, id), module_m / kTexelsPerModule, false);
  world.surfaces.push_back(surface);
}

}  // namespace

KnownMarkers add_markers(int num_markers, const Motion& motion, std::uint64_t seed, World& world) {
  KnownMarkers known;
  if (num_markers == 0) return known;
  const MarkerFamily family(kFamily);
  Markers places(motion, seed, world);
  known.family = family.name();
  known.size_m = places.side();
  for (int id = 0; id < num_markers; ++id) {
    const double part_s = motion.duration_s() / num_markers;
    const auto place = places.find(id * part_s, (id + 1) * part_s);
    if (!place) {
      throw InputError(fmt::format("world '{}'", world.name),
                       fmt::format("has room for {} markers, expected {}", id, num_markers));
    }
    known.by_id[id].world_from_marker = place->world_from_marker;
  }
  for (const auto& [id, marker] : known.by_id) {
    hang(family, id, *marker.world_from_marker, known.size_m, world);
  }
  return known;
}

}  // namespace waymark

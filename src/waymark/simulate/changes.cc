// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/changes.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"
#include "waymark/simulate/world_builder.h"

namespace waymark {
namespace {

using Eigen::Vector3d;

/// In texels of the world, which are the coarser the larger it is: a cupboard is 0.8 x 0.4 x 1.4 m
/// in a flat and four times as large in a street.
constexpr double kThingWidth = 200.0;
constexpr double kThingDepth = 100.0;
constexpr double kDoorDepth = 10.0;
constexpr double kThingHeight = 350.0;
constexpr double kNearestWay = 200.0;  ///< To the middle, from where the camera passes.
constexpr double kFarthestWay = 280.0;
constexpr double kWayClearance = 60.0;  ///< Around the way of the camera.

constexpr double kOpenRad = 0.45 * std::numbers::pi;
constexpr double kLookStepS = 0.1;  ///< In which the motion is looked at.
constexpr int kMaxPlaces = 2000;
constexpr double kLongS = 1e9;  ///< Before the first image and after the last.

/// Where something stands: x along its front, y away from the camera.
struct Place {
  Vector3d foot = Vector3d::Zero();
  Vector3d along = Vector3d::UnitX();
};

Vector3d levelled(const Vector3d& direction) {
  return direction.cwiseProduct(Vector3d(1.0, 1.0, 0.0)).normalized();
}

/// Moves surfaces that stand at the origin, turned about the vertical there.
void put(const Eigen::Isometry3d& world_from_thing, std::vector<Surface>& surfaces) {
  for (Surface& surface : surfaces) {
    surface.origin = world_from_thing * surface.origin;
    surface.u_axis = world_from_thing.linear() * surface.u_axis;
    surface.v_axis = world_from_thing.linear() * surface.v_axis;
  }
}

Eigen::Isometry3d pose_at(const Place& place) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear().col(0) = place.along;
  pose.linear().col(1) = Vector3d::UnitZ().cross(place.along);
  pose.translation() = place.foot;
  return pose;
}

/// Things beside the way of a camera.
class Changes {
 public:
  Changes(const Motion& motion, std::uint64_t seed, World& world)
      : motion_(motion), world_(world), seed_(seed), rng_(seed, 3) {
    texel_m_ = world.textures.front().texel_m();
    for (double t = 0.0; t <= motion.duration_s(); t += kLookStepS) {
      poses_.push_back(motion.world_from_rig(t));
    }
  }

  /// False where there is no room.
  bool add(int index) {
    for (int i = 0; i < kMaxPlaces; ++i) {
      const Place place = draw();
      if (!is_free(place)) continue;
      places_.push_back(place);
      index % 2 == 0 ? add_cupboard(place, index) : add_door(place, index);
      return true;
    }
    return false;
  }

 private:
  /// To one side of where the camera passes in the first half.
  Place draw() {
    const Rigid3 pose = motion_.world_from_rig(rng_.uniform(0.0, 0.5 * motion_.duration_s()));
    const Vector3d ahead = levelled(pose.rotation * Vector3d::UnitZ());
    const double side = rng_.below(2) == 0 ? -1.0 : 1.0;
    const Vector3d right(ahead.y(), -ahead.x(), 0.0);
    Place place;
    place.foot = pose.translation +
                 side * texel_m_ * rng_.uniform(kNearestWay, kFarthestWay) * right +
                 texel_m_ * kThingWidth * ahead;
    place.foot.z() = 0.0;
    place.along = -side * ahead;
    eye_ = pose.translation;
    return place;
  }

  /// Clear of the way and of others, and not behind a wall.
  bool is_free(const Place& place) const {
    const double half = 0.5 * texel_m_ * std::hypot(kThingWidth, kThingDepth);
    const auto distance_to = [&](const Vector3d& point) {
      return (point - place.foot).head<2>().norm();
    };
    for (const Rigid3& pose : poses_) {
      if (distance_to(pose.translation) < half + texel_m_ * kWayClearance) return false;
    }
    for (const Place& other : places_) {
      if (distance_to(other.foot) < 2.0 * half) return false;
    }
    for (const double end : {-0.5, 0.0, 0.5}) {
      Vector3d seen = place.foot + end * texel_m_ * kThingWidth * place.along;
      seen.z() = eye_.z();
      const auto hit = world_.intersect(eye_, seen - eye_);
      if (hit && hit->hit.distance < 1.0) return false;
    }
    return true;
  }

  /// When it is behind the camera, from the middle of the motion on.
  double change_time(const Place& place) const {
    const double middle_s = 0.5 * motion_.duration_s();
    for (double t = middle_s; t < motion_.duration_s(); t += kLookStepS) {
      const Vector3d in_rig = motion_.world_from_rig(t).inverse() * place.foot;
      if (in_rig.z() < -texel_m_ * kThingWidth) return t;
    }
    return middle_s;
  }

  std::vector<Surface> make_box(double depth, int index) {
    const double half_width = 0.5 * texel_m_ * kThingWidth;
    const double half_depth = 0.5 * texel_m_ * depth;
    WorldBuilder builder(seed_ + 200 + static_cast<std::uint64_t>(index), texel_m_);
    builder.add_box(
        {{-half_width, -half_depth, 0.0}, {half_width, half_depth, texel_m_ * kThingHeight}},
        0.0,
        Style::kBooks);
    World part = builder.build("");
    const auto first_texture = static_cast<std::uint32_t>(world_.textures.size());
    for (Texture& texture : part.textures) world_.textures.push_back(std::move(texture));
    for (Surface& surface : part.surfaces) surface.texture += first_texture;
    return part.surfaces;
  }

  void stand(const std::vector<Surface>& surfaces, double start_s, double end_s) {
    Pedestrian walk;
    walk.first_surface = static_cast<std::uint32_t>(world_.surfaces.size());
    world_.surfaces.insert(world_.surfaces.end(), surfaces.begin(), surfaces.end());
    walk.end_surface = static_cast<std::uint32_t>(world_.surfaces.size());
    walk.start_s = start_s;
    walk.end_s = end_s;
    world_.walks.push_back(walk);
  }

  void add_cupboard(const Place& place, int index) {
    std::vector<Surface> surfaces = make_box(kThingDepth, index);
    put(pose_at(place), surfaces);
    stand(surfaces, -kLongS, change_time(place));
  }

  /// That turns about the end of it, away from the camera.
  void add_door(const Place& place, int index) {
    std::vector<Surface> closed = make_box(kDoorDepth, index);
    std::vector<Surface> open = closed;
    const Vector3d hinge(0.5 * texel_m_ * kThingWidth, 0.0, 0.0);
    const Eigen::Isometry3d opened = Eigen::Translation3d(hinge) *
                                     Eigen::AngleAxisd(-kOpenRad, Vector3d::UnitZ()) *
                                     Eigen::Translation3d(-hinge);
    put(pose_at(place), closed);
    put(pose_at(place) * opened, open);
    const double change_s = change_time(place);
    stand(closed, -kLongS, change_s);
    stand(open, change_s, kLongS);
  }

  const Motion& motion_;
  World& world_;
  std::uint64_t seed_;
  Rng rng_;
  double texel_m_ = 0.0;
  std::vector<Rigid3> poses_;
  std::vector<Place> places_;
  Vector3d eye_ = Vector3d::Zero();
};

}  // namespace

void add_changes(int num_changes, const Motion& motion, std::uint64_t seed, World& world) {
  Changes changes(motion, seed, world);
  for (int i = 0; i < num_changes; ++i) {
    if (changes.add(i)) continue;
    throw InputError(
        fmt::format("world '{}'", world.name),
        fmt::format("has room for {} things that change, expected {}", i, num_changes));
  }
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/pedestrians.h"

#include <cmath>
#include <string>
#include <utility>

#include "waymark/base/rng.h"
#include "waymark/simulate/world_builder.h"

namespace waymark {
namespace {

using Eigen::Vector3d;

constexpr double kWalkerTexelM = 0.004;
constexpr double kCrossing_s = 4.0;   ///< From one side of the view to the other.
constexpr double kHalfWayPerM = 0.9;  ///< To the side of the view, per metre of distance.
constexpr double kNearestM = 1.1;
constexpr double kFarthestM = 1.8;

/// Body and head, upright, with the feet at the origin.
World make_person(std::uint64_t seed, double height_m) {
  WorldBuilder builder(seed, kWalkerTexelM);
  builder.add_cylinder(Vector3d::Zero(), 0.24, height_m - 0.28, Style::kBooks);
  builder.add_sphere({0.0, 0.0, height_m - 0.13}, 0.13, Style::kMetal);
  return builder.build("person");
}

/// The way of somebody who is straight ahead of the camera in the middle of the crossing.
Pedestrian cross_view(const Motion& motion, double start_s, Rng& rng) {
  const double middle_s = start_s + 0.5 * kCrossing_s;
  const Rigid3 world_from_rig = motion.world_from_rig(middle_s);
  const Vector3d ahead = (world_from_rig.rotation * Vector3d::UnitZ())
                             .cwiseProduct(Vector3d(1.0, 1.0, 0.0))
                             .normalized();
  const Vector3d right(ahead.y(), -ahead.x(), 0.0);
  const double distance_m = rng.uniform(kNearestM, kFarthestM);
  const double side = rng.below(2) == 0 ? -1.0 : 1.0;
  Pedestrian walk;
  walk.start_s = start_s;
  walk.end_s = start_s + kCrossing_s;
  const Vector3d moved = motion.world_from_rig(walk.end_s).translation -
                         motion.world_from_rig(walk.start_s).translation;
  walk.velocity = (side * 2.0 * kHalfWayPerM * distance_m * right + moved) / kCrossing_s;
  const Vector3d middle = world_from_rig.translation + distance_m * ahead;
  walk.start = middle - 0.5 * kCrossing_s * walk.velocity;
  walk.start.z() = walk.velocity.z() = 0.0;
  return walk;
}

}  // namespace

void add_pedestrians(int num_walkers, const Motion& motion, std::uint64_t seed, World& world) {
  Rng rng(seed, 2);
  for (int i = 0; i < num_walkers; ++i) {
    World person = make_person(seed + 100 + static_cast<std::uint64_t>(i), rng.uniform(1.65, 1.9));
    const auto first_texture = static_cast<std::uint32_t>(world.textures.size());
    for (Texture& texture : person.textures) world.textures.push_back(std::move(texture));
    const double offset_s = kCrossing_s * (static_cast<double>(i) / num_walkers - 1.0);
    for (double start_s = offset_s; start_s < motion.duration_s(); start_s += kCrossing_s) {
      Pedestrian walk = cross_view(motion, start_s, rng);
      walk.first_surface = static_cast<std::uint32_t>(world.surfaces.size());
      for (Surface surface : person.surfaces) {
        surface.texture += first_texture;
        world.surfaces.push_back(surface);
      }
      walk.end_surface = static_cast<std::uint32_t>(world.surfaces.size());
      world.walks.push_back(walk);
    }
  }
}

}  // namespace waymark

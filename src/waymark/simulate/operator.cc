// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/operator.h"

#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "waymark/simulate/world_builder.h"

namespace waymark {
namespace {

using Eigen::Vector3d;

constexpr double kOperatorTexelM = 0.003;
/// Of the body below the camera, from the frequency of steps on.
constexpr double kSwayM = 0.015;
constexpr double kSwayDeg = 2.5;
constexpr double kStepsHz = 0.9;

/// From the axes of parts (x ahead, y left, z up; the camera at the origin) to those of a rig that
/// looks ahead.
Rigid3 rig_from_part() { return pose_of(MotionKey{}).inverse(); }

/// A cylinder between two points, the first of which is the upper end.
Surface make_limb(const Vector3d& upper, const Vector3d& lower, double radius) {
  Surface limb = make_cylinder(Vector3d::Zero(), radius, (lower - upper).norm());
  limb.origin = upper;
  limb.v_axis = (lower - upper).normalized();
  limb.u_axis = limb.v_axis.unitOrthogonal();
  return limb;
}

const Vector3d kHand(0.08, -0.22, -0.5);  // Beside the head, on the right.

/// What is fixed to the camera: the pole and the hand.
World make_pole(std::uint64_t seed) {
  WorldBuilder builder(seed, kOperatorTexelM);
  builder.add(make_limb(0.2 * kHand, kHand, 0.012), Style::kMetal);
  builder.add_sphere(kHand, 0.05, Style::kCrate);
  return builder.build("pole");
}

/// Head, shoulders, trunk and the arm that holds the pole up.
World make_body(std::uint64_t seed) {
  const Vector3d elbow(0.02, -0.38, -0.75);
  const Vector3d right_shoulder(-0.03, -0.2, -0.66);
  const Vector3d left_shoulder(-0.03, 0.2, -0.66);
  WorldBuilder builder(seed, kOperatorTexelM);
  builder.add_sphere({-0.03, 0.0, -0.42}, 0.12, Style::kCrate);
  builder.add_sphere(right_shoulder, 0.1, Style::kBooks);
  builder.add_sphere(left_shoulder, 0.1, Style::kBooks);
  builder.add_cylinder({-0.03, 0.0, -2.1}, 0.18, 1.5, Style::kBooks);
  builder.add(make_limb(kHand, elbow, 0.045), Style::kBooks);
  builder.add(make_limb(right_shoulder, elbow, 0.055), Style::kBooks);
  builder.add_sphere(elbow, 0.055, Style::kBooks);
  return builder.build("body");
}

void add_carried(World part, std::function<Rigid3(double)> world_from_part, World& world) {
  const auto first_texture = static_cast<std::uint32_t>(world.textures.size());
  const auto first_surface = static_cast<std::uint32_t>(world.surfaces.size());
  for (Texture& texture : part.textures) world.textures.push_back(std::move(texture));
  for (Surface surface : part.surfaces) {
    surface.texture += first_texture;
    world.surfaces.push_back(surface);
  }
  const auto end_surface = static_cast<std::uint32_t>(world.surfaces.size());
  world.carried.push_back({first_surface, end_surface, std::move(world_from_part)});
}

/// Where the camera is, turned to where it looks, and upright.
Rigid3 upright(const Rigid3& world_from_rig) {
  const Vector3d ahead = world_from_rig.rotation * Vector3d::UnitZ();
  const Eigen::AngleAxisd heading(std::atan2(ahead.y(), ahead.x()), Vector3d::UnitZ());
  return {Eigen::Quaterniond(heading), world_from_rig.translation};
}

}  // namespace

void add_operator(const Motion& motion, std::uint64_t seed, World& world) {
  const auto world_from_pole = [motion](double time_s) {
    return motion.world_from_rig(time_s) * rig_from_part();
  };
  add_carried(make_pole(seed + 200), world_from_pole, world);
  const Motion sway(
      std::vector<MotionKey>(4), motion.duration_s(), {kSwayM, kSwayDeg, seed + 201, kStepsHz});
  const auto world_from_body = [motion, sway](double time_s) {
    return upright(motion.world_from_rig(time_s)) * sway.world_from_rig(time_s) * rig_from_part();
  };
  add_carried(make_body(seed + 202), world_from_body, world);
}

}  // namespace waymark

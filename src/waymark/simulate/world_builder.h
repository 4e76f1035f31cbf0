// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "waymark/simulate/texture_drawing.h"
#include "waymark/simulate/world.h"

namespace waymark {

/// A gap in a wall from the floor up, from and to along the wall.
struct Opening {
  double from = 0.0;
  double to = 0.0;
  double height = 2.05;
};

/// An axis-aligned box in the world.
struct Box {
  Eigen::Vector3d min = Eigen::Vector3d::Zero();
  Eigen::Vector3d max = Eigen::Vector3d::Zero();
};

/// The openings of the four walls of a room, each measured from the wall's left end as seen from
/// inside.
struct RoomOpenings {
  std::vector<Opening> at_max_x;
  std::vector<Opening> at_max_y;
  std::vector<Opening> at_min_x;
  std::vector<Opening> at_min_y;
};

/// Puts surfaces together; each gets a texture of its own. Textures depend on the seed and on how
/// many came before with it, so that parts built alike with the same seed look alike.
class WorldBuilder {
 public:
  WorldBuilder(std::uint64_t seed, double texel_m) : seed_(seed), texel_m_(texel_m) {}

  void add(Surface surface, Style style);
  /// The wall from a to b over [bottom, top], seen with a on the left, with gaps.
  void add_wall(const Eigen::Vector2d& a,
                const Eigen::Vector2d& b,
                const Eigen::Vector2d& bottom_top,
                std::span<const Opening> openings,
                Style style);
  /// A level rectangle seen from above.
  void add_ground(const Eigen::Vector2d& min, const Eigen::Vector2d& max, double z, Style style);
  /// Walls, floor and ceiling, seen from inside; all blank where the walls are.
  void add_room(const Box& box, const RoomOpenings& openings, Style walls);
  /// Four sides and the top, turned around the vertical through its centre.
  void add_box(const Box& box, double turn_deg, Style style);
  /// A table: top on four legs.
  void add_table(const Box& box, Style style);
  void add_cylinder(const Eigen::Vector3d& base, double radius, double height, Style style);
  void add_sphere(const Eigen::Vector3d& centre, double radius, Style style);
  /// The inside of a doorway between two rooms: jambs, lintel and threshold; passage_axis 0: one
  /// walks along x, 1: along y.
  void add_doorway(const Box& box, int passage_axis);

  /// Textures that follow come from this seed, counted from the start.
  void restart_textures(std::uint64_t seed);

  World build(std::string name);

 private:
  std::uint64_t seed_;
  double texel_m_;
  std::uint64_t num_painted_ = 0;
  World world_;
};

}  // namespace waymark

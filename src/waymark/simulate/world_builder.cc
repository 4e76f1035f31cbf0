// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/world_builder.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace waymark {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Vector3d at_height(const Vector2d& point, double z) { return {point.x(), point.y(), z}; }

const Vector3d kDown(0.0, 0.0, -1.0);

}  // namespace

void WorldBuilder::add(Surface surface, Style style) {
  Rng rng(seed_, num_painted_++);
  // The columns of a round texture must meet where it closes.
  const double texel =
      is_round(surface.kind) ? surface.size.x() / std::ceil(surface.size.x() / texel_m_) : texel_m_;
  surface.texture = static_cast<std::uint32_t>(world_.textures.size());
  world_.textures.emplace_back(
      paint(style, surface.size, texel, rng), texel, is_round(surface.kind));
  world_.surfaces.push_back(surface);
}

void WorldBuilder::add_wall(const Vector2d& a,
                            const Vector2d& b,
                            const Vector2d& bottom_top,
                            std::span<const Opening> openings,
                            Style style) {
  const Vector2d along = (b - a).normalized();
  const Vector3d right(along.x(), along.y(), 0.0);
  const double top = bottom_top.y();
  const auto add_piece = [&](double from, double to, double bottom) {
    if (to - from < 1e-6 || top - bottom < 1e-6) return;
    add(make_rectangle(at_height(a + from * along, top), right, kDown, {to - from, top - bottom}),
        style);
  };
  double done = 0.0;
  for (const Opening& opening : openings) {
    add_piece(done, opening.from, bottom_top.x());
    add_piece(opening.from, opening.to, bottom_top.x() + opening.height);
    done = opening.to;
  }
  add_piece(done, (b - a).norm(), bottom_top.x());
}

void WorldBuilder::add_ground(const Vector2d& min, const Vector2d& max, double z, Style style) {
  add(make_rectangle({min.x(), max.y(), z}, Vector3d::UnitX(), -Vector3d::UnitY(), max - min),
      style);
}

void WorldBuilder::add_room(const Box& box, const RoomOpenings& openings, Style walls) {
  const Vector2d z(box.min.z(), box.max.z());
  const Vector2d min = box.min.head<2>();
  const Vector2d max = box.max.head<2>();
  const Vector2d right_low(max.x(), min.y());
  const Vector2d left_high(min.x(), max.y());
  add_wall(max, right_low, z, openings.at_max_x, walls);
  add_wall(left_high, max, z, openings.at_max_y, walls);
  add_wall(min, left_high, z, openings.at_min_x, walls);
  add_wall(right_low, min, z, openings.at_min_y, walls);
  const bool is_blank = walls == Style::kBlank;
  add_ground(min, max, z.x(), is_blank ? Style::kBlank : Style::kFloor);
  add(make_rectangle(at_height(min, z.y()), Vector3d::UnitX(), Vector3d::UnitY(), max - min),
      is_blank ? Style::kBlank : Style::kCeiling);
}

void WorldBuilder::add_box(const Box& box, double turn_deg, Style style) {
  const double turn = turn_deg * std::numbers::pi / 180.0;
  const Vector3d x_axis(std::cos(turn), std::sin(turn), 0.0);
  const Vector3d y_axis(-x_axis.y(), x_axis.x(), 0.0);
  const Vector3d centre = 0.5 * (box.min + box.max);
  const Vector3d half = 0.5 * (box.max - box.min);
  const auto corner = [&](double x, double y, double z) {
    return Vector3d(centre + x * half.x() * x_axis + y * half.y() * y_axis +
                    z * half.z() * Vector3d::UnitZ());
  };
  const Vector2d front(2.0 * half.x(), 2.0 * half.z());
  const Vector2d side(2.0 * half.y(), 2.0 * half.z());
  add(make_rectangle(corner(-1, -1, 1), x_axis, kDown, front), style);
  add(make_rectangle(corner(1, -1, 1), y_axis, kDown, side), style);
  add(make_rectangle(corner(1, 1, 1), -x_axis, kDown, front), style);
  add(make_rectangle(corner(-1, 1, 1), -y_axis, kDown, side), style);
  add(make_rectangle(corner(-1, 1, 1), x_axis, -y_axis, 2.0 * half.head<2>()), style);
}

void WorldBuilder::add_table(const Box& box, Style style) {
  constexpr double kLeg = 0.06;
  constexpr double kThickness = 0.05;
  Box top = box;
  top.min.z() = box.max.z() - kThickness;
  add_box(top, 0.0, style);
  for (const double x : {box.min.x() + 0.05, box.max.x() - 0.05 - kLeg}) {
    for (const double y : {box.min.y() + 0.05, box.max.y() - 0.05 - kLeg}) {
      const Vector3d foot(x, y, box.min.z());
      add_box({foot, foot + Vector3d(kLeg, kLeg, top.min.z() - box.min.z())}, 0.0, Style::kMetal);
    }
  }
}

void WorldBuilder::add_cylinder(const Vector3d& base, double radius, double height, Style style) {
  add(make_cylinder(base, radius, height), style);
  add(make_disc(base + height * Vector3d::UnitZ(), Vector3d::UnitZ(), radius), style);
}

void WorldBuilder::add_sphere(const Vector3d& centre, double radius, Style style) {
  add(make_sphere(centre, radius), style);
}

void WorldBuilder::add_doorway(const Box& box, int passage_axis) {
  const Vector2d z(box.min.z(), box.max.z());
  const Vector2d min = box.min.head<2>();
  const Vector2d max = box.max.head<2>();
  const Vector2d right_low(max.x(), min.y());
  const Vector2d left_high(min.x(), max.y());
  if (passage_axis == 0) {
    add_wall(left_high, max, z, {}, Style::kCrate);
    add_wall(right_low, min, z, {}, Style::kCrate);
  } else {
    add_wall(max, right_low, z, {}, Style::kCrate);
    add_wall(min, left_high, z, {}, Style::kCrate);
  }
  add_ground(min, max, z.x(), Style::kTiles);
  add(make_rectangle(at_height(min, z.y()), Vector3d::UnitX(), Vector3d::UnitY(), max - min),
      Style::kCrate);
}

void WorldBuilder::restart_textures(std::uint64_t seed) {
  seed_ = seed;
  num_painted_ = 0;
}

World WorldBuilder::build(std::string name) {
  world_.name = std::move(name);
  return std::move(world_);
}

}  // namespace waymark

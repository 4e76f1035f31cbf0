// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/simulate/street_world.h"
#include "waymark/simulate/world_builder.h"

namespace waymark {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kRoomTexelM = 0.004;
constexpr double kHallTexelM = 0.008;
constexpr double kDoorWidth = 1.0;
constexpr double kDoorHeight = 2.05;
constexpr double kWallThickness = 0.2;

Opening door_at(double middle) {
  return {middle - 0.5 * kDoorWidth, middle + 0.5 * kDoorWidth, kDoorHeight};
}

/// A box of this size around the middle of its foot.
Box box_on(const Vector3d& foot, const Vector3d& size) {
  const Vector3d half(0.5 * size.x(), 0.5 * size.y(), 0.0);
  return {foot - half, foot + half + Vector3d(0.0, 0.0, size.z())};
}

void add_crates(WorldBuilder& builder, const Vector3d& foot, double side, Rng& rng) {
  builder.add_box(box_on(foot, Vector3d::Constant(side)), rng.uniform(5.0, 40.0), Style::kCrate);
  const Vector3d upper = foot + Vector3d(0.1 * side, -0.05 * side, side);
  builder.add_box(
      box_on(upper, Vector3d::Constant(0.6 * side)), rng.uniform(-40.0, 0.0), Style::kCrate);
}

void add_globe(WorldBuilder& builder, const Vector3d& foot, bool is_blank) {
  builder.add_cylinder(foot, 0.2, 0.9, is_blank ? Style::kBlank : Style::kCrate);
  const Vector3d centre = foot + Vector3d(0.0, 0.0, 1.1);
  builder.add_sphere(centre, 0.2, is_blank ? Style::kBlank : Style::kMetal);
}

void add_cabinet(WorldBuilder& builder, const Vector3d& foot, bool is_blank) {
  builder.add_box(box_on(foot, {0.9, 0.45, 0.8}), 0.0, is_blank ? Style::kBlank : Style::kCrate);
}

/// Furniture in the four corners of a room; doors in the middle of the walls stay free. Of blank
/// furniture only books and crates have any texture.
void furnish_corners(WorldBuilder& builder, const Box& room, bool is_blank, Rng& rng) {
  std::array<int, 4> kinds = {0, 1, 2, 3};
  for (std::uint32_t i = 3; i > 0; --i) std::swap(kinds[i], kinds[rng.below(i + 1)]);
  for (int corner = 0; corner < 4; ++corner) {
    const bool is_high_x = (corner & 1) != 0;
    const bool is_high_y = (corner & 2) != 0;
    const Vector2d inward(is_high_x ? -1.0 : 1.0, is_high_y ? -1.0 : 1.0);
    const Vector2d at(is_high_x ? room.max.x() : room.min.x(),
                      is_high_y ? room.max.y() : room.min.y());
    const auto foot = [&](double x, double y) {
      return Vector3d(at.x() + x * inward.x(), at.y() + y * inward.y(), room.min.z());
    };
    switch (kinds[static_cast<std::size_t>(corner)]) {
      case 0:
        builder.add_box(box_on(foot(0.52, 0.19), {1.0, 0.34, 1.9}), 0.0, Style::kBooks);
        break;
      case 1:
        add_crates(builder, foot(0.5, 0.5), 0.55, rng);
        break;
      case 2:
        add_globe(builder, foot(0.4, 0.4), is_blank);
        break;
      default:
        add_cabinet(builder, foot(0.5, 0.25), is_blank);
        builder.add_box(box_on(foot(0.4, 0.25) + Vector3d(0.0, 0.0, 0.8), {0.3, 0.2, 0.35}),
                        20.0,
                        is_blank ? Style::kBlank : Style::kMetal);
    }
  }
}

void furnish_room(WorldBuilder& builder, Rng& rng) {
  builder.add_table({{2.35, 2.1, 0.0}, {3.65, 2.9, 0.74}}, Style::kFloor);
  builder.add_box(box_on({2.7, 2.4, 0.74}, {0.3, 0.2, 0.25}), 25.0, Style::kCrate);
  builder.add_box(box_on({3.3, 2.7, 0.74}, {0.25, 0.18, 0.12}), -15.0, Style::kMetal);
  builder.add_sphere({3.25, 2.3, 0.87}, 0.13, Style::kMetal);
  builder.add_cylinder({2.95, 2.7, 0.74}, 0.07, 0.28, Style::kCrate);
  builder.add_box({{0.5, 4.62, 0.0}, {2.3, 5.0, 2.05}}, 0.0, Style::kBooks);
  builder.add_box({{3.3, 4.55, 0.0}, {4.6, 5.0, 0.85}}, 0.0, Style::kCrate);
  builder.add_box({{3.5, 4.7, 0.85}, {4.2, 4.8, 1.3}}, 5.0, Style::kPicture);
  builder.add_box({{0.0, 1.4, 0.0}, {0.42, 3.0, 1.1}}, 0.0, Style::kBooks);
  builder.add_box({{2.0, 0.0, 0.0}, {3.4, 0.4, 0.9}}, 0.0, Style::kCrate);
  builder.add_sphere({2.4, 0.2, 1.08}, 0.18, Style::kMetal);
  builder.add_cylinder({5.6, 0.4, 0.0}, 0.2, 2.8, Style::kMetal);
  builder.add_cylinder({5.5, 4.5, 0.0}, 0.28, 1.0, Style::kCrate);
  add_crates(builder, {0.55, 0.55, 0.0}, 0.6, rng);
}

World make_one_room(std::uint64_t seed, Style walls, const char* name) {
  WorldBuilder builder(seed, kRoomTexelM);
  Rng rng(seed, 1);
  builder.add_room({{0.0, 0.0, 0.0}, {6.0, 5.0, 2.8}}, {}, walls);
  if (walls == Style::kBare) {
    builder.add_table({{2.35, 2.1, 0.0}, {3.65, 2.9, 0.74}}, Style::kFloor);
    add_crates(builder, {0.55, 0.55, 0.0}, 0.6, rng);
  } else {
    furnish_room(builder, rng);
  }
  return builder.build(name);
}

World make_room(std::uint64_t seed) { return make_one_room(seed, Style::kWall, "room"); }

World make_bare_room(std::uint64_t seed) { return make_one_room(seed, Style::kBare, "bare"); }

World make_four_rooms(std::uint64_t seed, Style walls, const char* name) {
  constexpr double kWidth = 4.0;
  constexpr double kDepth = 3.5;
  constexpr double kRight = kWidth + kWallThickness;
  constexpr double kUp = kDepth + kWallThickness;
  WorldBuilder builder(seed, kRoomTexelM);
  Rng rng(seed, 1);
  for (int room = 0; room < 4; ++room) {
    const bool is_right = (room & 1) != 0;
    const bool is_upper = (room & 2) != 0;
    const Vector3d corner(is_right ? kRight : 0.0, is_upper ? kUp : 0.0, 0.0);
    const Box box{corner, corner + Vector3d(kWidth, kDepth, 2.6)};
    RoomOpenings openings;
    (is_right ? openings.at_min_x : openings.at_max_x) = {door_at(0.5 * kDepth)};
    (is_upper ? openings.at_min_y : openings.at_max_y) = {door_at(0.5 * kWidth)};
    builder.add_room(box, openings, walls);
    furnish_corners(builder, box, walls == Style::kBlank, rng);
  }
  for (const double offset : {0.0, kUp}) {
    const double y = offset + 0.5 * (kDepth - kDoorWidth);
    builder.add_doorway({{kWidth, y, 0.0}, {kRight, y + kDoorWidth, kDoorHeight}}, 0);
  }
  for (const double offset : {0.0, kRight}) {
    const double x = offset + 0.5 * (kWidth - kDoorWidth);
    builder.add_doorway({{x, kDepth, 0.0}, {x + kDoorWidth, kUp, kDoorHeight}}, 1);
  }
  return builder.build(name);
}

World make_apartment(std::uint64_t seed) {
  return make_four_rooms(seed, Style::kWall, "apartment");
}

World make_blank_apartment(std::uint64_t seed) {
  return make_four_rooms(seed, Style::kBlank, "blank");
}

World make_twins(std::uint64_t seed) {
  constexpr double kWidth = 4.5;
  constexpr double kDepth = 4.0;
  constexpr double kApart = 5.2;
  WorldBuilder builder(seed, kRoomTexelM);
  std::vector<Opening> doors;
  for (const double x : {0.0, kApart}) {
    builder.restart_textures(seed + 1);
    Rng rng(seed, 1);
    const Box box{{x, 0.0, 0.0}, {x + kWidth, kDepth, 2.6}};
    RoomOpenings openings;
    openings.at_min_y = {door_at(0.5 * kWidth)};
    builder.add_room(box, openings, Style::kWall);
    furnish_corners(builder, box, false, rng);
    const double left = x + 0.5 * (kWidth - kDoorWidth);
    builder.add_doorway({{left, -kWallThickness, 0.0}, {left + kDoorWidth, 0.0, kDoorHeight}}, 1);
    doors.push_back(door_at(x + 0.5 * kWidth));
  }
  builder.restart_textures(seed);
  RoomOpenings openings;
  openings.at_max_y = doors;
  const double length = kApart + kWidth;
  builder.add_room({{0.0, -2.4, 0.0}, {length, -kWallThickness, 2.6}}, openings, Style::kWall);
  return builder.build("twins");
}

World make_hall(std::uint64_t seed) {
  WorldBuilder builder(seed, kHallTexelM);
  Rng rng(seed, 1);
  builder.add_room({{0.0, 0.0, 0.0}, {24.0, 16.0, 7.0}}, {}, Style::kWall);
  for (const double x : {6.0, 12.0, 18.0}) {
    builder.add_cylinder({x, 8.0, 0.0}, 0.35, 7.0, Style::kMetal);
    const double side = rng.uniform(0.8, 1.2);
    const double y = 8.0 + rng.uniform(-0.4, 0.4);
    add_crates(builder, {x + 1.2, y, 0.0}, side, rng);
  }
  for (const double y : {1.2, 14.8}) {
    for (double x = 2.5; x < 22.5; x += rng.uniform(2.2, 3.4)) {
      const Vector3d foot(x, y + rng.uniform(-0.3, 0.3), 0.0);
      const double side = rng.uniform(0.7, 1.4);
      if (rng.below(3) == 0) {
        builder.add_cylinder(foot, 0.45 * side, 1.2 * side, Style::kMetal);
      } else {
        add_crates(builder, foot, side, rng);
      }
    }
  }
  for (const double x : {0.8, 23.2}) {
    builder.add_box(box_on({x, 5.0, 0.0}, {1.0, 4.0, 2.8}), 0.0, Style::kBooks);
    builder.add_box(box_on({x, 11.0, 0.0}, {1.2, 2.5, 1.6}), 0.0, Style::kCrate);
  }
  builder.add_sphere({14.5, 11.0, 5.2}, 0.9, Style::kMetal);
  return builder.build("hall");
}

/// Twenty times the same stretch, with a door and a locker.
World make_corridor(std::uint64_t seed) {
  constexpr int kNumDoors = 20;
  const Vector3d size(2.5, 2.2, 2.6);  // Of a stretch.
  const Vector2d z(0.0, size.z());
  WorldBuilder builder(seed, kRoomTexelM);
  for (int i = 0; i < kNumDoors; ++i) {
    builder.restart_textures(seed + 1);
    const double x = size.x() * i;
    const double end = x + size.x();
    builder.add_wall({x, size.y()}, {end, size.y()}, z, {}, Style::kWall);
    builder.add_wall({end, 0.0}, {x, 0.0}, z, {}, Style::kWall);
    builder.add_ground({x, 0.0}, {end, size.y()}, 0.0, Style::kFloor);
    builder.add(make_rectangle(
                    {x, 0.0, size.z()}, Vector3d::UnitX(), Vector3d::UnitY(), {size.x(), size.y()}),
                Style::kCeiling);
    builder.add_box(
        {{x + 0.8, size.y() - 0.05, 0.0}, {x + 1.8, size.y(), kDoorHeight}}, 0.0, Style::kCrate);
    builder.add_box({{x + 0.3, 0.0, 0.0}, {x + 0.8, 0.25, 0.9}}, 0.0, Style::kMetal);
  }
  builder.restart_textures(seed);
  const double length = kNumDoors * size.x();
  builder.add_wall({length, size.y()}, {length, 0.0}, z, {}, Style::kWall);
  builder.add_wall({0.0, 0.0}, {0.0, size.y()}, z, {}, Style::kWall);
  return builder.build("corridor");
}

World make_shop(std::uint64_t seed) {
  WorldBuilder builder(seed, kHallTexelM);
  builder.add_room({{0.0, 0.0, 0.0}, {24.0, 15.0, 3.5}}, {}, Style::kWall);
  for (const double y : {3.0, 6.0, 9.0, 12.0}) {
    for (const double x : {6.5, 17.5}) {
      builder.restart_textures(seed + 1);
      builder.add_box(box_on({x, y, 0.0}, {7.0, 0.9, 2.0}), 0.0, Style::kBooks);
    }
  }
  return builder.build("shop");
}

struct NamedWorld {
  std::string_view name;
  World (*make)(std::uint64_t seed);
};

constexpr std::array<NamedWorld, 9> kWorlds = {{{"room", make_room},
                                                {"apartment", make_apartment},
                                                {"hall", make_hall},
                                                {"street", make_street},
                                                {"twins", make_twins},
                                                {"bare", make_bare_room},
                                                {"blank", make_blank_apartment},
                                                {"corridor", make_corridor},
                                                {"shop", make_shop}}};

}  // namespace

std::vector<std::string> world_names() {
  std::vector<std::string> names;
  for (const NamedWorld& world : kWorlds) names.emplace_back(world.name);
  return names;
}

std::shared_ptr<const World> make_world(std::string_view name, std::uint64_t seed) {
  for (const NamedWorld& world : kWorlds) {
    if (world.name == name) return std::make_shared<const World>(world.make(seed));
  }
  throw InputError(fmt::format("world '{}'", name),
                   fmt::format("unknown, expected one of {}", fmt::join(world_names(), ", ")));
}

}  // namespace waymark

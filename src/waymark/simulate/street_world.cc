// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/street_world.h"

#include <array>

#include "waymark/simulate/world_builder.h"

namespace waymark {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTexelM = 0.016;
/// The middle of the road is the rectangle (0, 0) to (kLength, kWidth).
constexpr double kLength = 40.0;
constexpr double kWidth = 28.0;
constexpr double kRoadHalf = 4.0;
constexpr double kPavementEnd = 7.5;

/// One side of the loop: starts at a corner of the road's middle and runs along; left points to the
/// inside of the block.
struct Side {
  Vector2d start;
  Vector2d along;
  double length;

  Vector2d left() const { return {-along.y(), along.x()}; }
  Vector2d at(double s, double to_left) const { return start + s * along + to_left * left(); }
  Vector3d at(double s, double to_left, double z) const {
    const Vector2d point = at(s, to_left);
    return {point.x(), point.y(), z};
  }
};

const std::array<Side, 4> kSides = {{{{0.0, 0.0}, {1.0, 0.0}, kLength},
                                     {{kLength, 0.0}, {0.0, 1.0}, kWidth},
                                     {{kLength, kWidth}, {-1.0, 0.0}, kLength},
                                     {{0.0, kWidth}, {0.0, -1.0}, kWidth}}};

void add_ground(WorldBuilder& builder) {
  const auto add_ring = [&](double from, double to, Style style) {
    // The ring between two rectangles around the middle of the road, -: inside.
    const double low = -to;
    const double x1 = kLength + to;
    const double y1 = kWidth + to;
    const double width = to - from;
    builder.add_ground({low, low}, {x1, low + width}, 0.0, style);
    builder.add_ground({low, y1 - width}, {x1, y1}, 0.0, style);
    builder.add_ground({low, low + width}, {low + width, y1 - width}, 0.0, style);
    builder.add_ground({x1 - width, low + width}, {x1, y1 - width}, 0.0, style);
  };
  add_ring(kRoadHalf, kPavementEnd, Style::kPavement);
  add_ring(-kRoadHalf, kRoadHalf, Style::kRoad);
  add_ring(-kPavementEnd, -kRoadHalf, Style::kPavement);
}

/// Front and flanks of a house whose front runs from a to b, a on the left as seen from the road.
void add_house(WorldBuilder& builder, const Vector2d& a, const Vector2d& b, double height) {
  constexpr double kFlank = 2.5;
  const Vector2d along = (b - a).normalized();
  const Vector2d back(-along.y() * kFlank, along.x() * kFlank);
  builder.add_wall(a, b, {0.0, height}, {}, Style::kFacade);
  builder.add_wall(a + back, a, {0.0, height}, {}, Style::kFacade);
  builder.add_wall(b, b + back, {0.0, height}, {}, Style::kFacade);
}

void add_houses(WorldBuilder& builder, const Side& side, Rng& rng) {
  for (double s = -9.0; s < side.length + 9.0;) {
    const double end = s + rng.uniform(6.0, 10.0);
    const double setback = -6.2 - rng.uniform(0.0, 1.2);
    // The outer houses look to the left, hence run against the direction of the side.
    add_house(builder, side.at(end, setback), side.at(s, setback), rng.uniform(6.0, 11.0));
    s = end;
  }
  for (double s = 6.5; s < side.length - 7.0;) {
    double end = s + rng.uniform(5.0, 8.0);
    if (side.length - 6.5 - end < 4.0) end = side.length - 6.5;
    const double setback = 6.4 + rng.uniform(0.0, 1.0);
    add_house(builder, side.at(s, setback), side.at(end, setback), rng.uniform(6.0, 11.0));
    s = end;
  }
}

void add_tree(WorldBuilder& builder, const Vector3d& foot, Rng& rng) {
  const double height = rng.uniform(1.9, 2.4);
  const double radius = rng.uniform(0.8, 1.1);
  builder.add_cylinder(foot, 0.14, height + 0.3, Style::kCrate);
  builder.add_sphere(foot + Vector3d(0.0, 0.0, height + radius), radius, Style::kFoliage);
}

void add_parked_car(WorldBuilder& builder, const Side& side, double s, double to_left) {
  const bool is_along_x = side.along.x() != 0.0;
  const auto add = [&](double length, double width, double bottom, double top) {
    const Vector3d centre = side.at(s, to_left, 0.0);
    const Vector2d half = 0.5 * (is_along_x ? Vector2d(length, width) : Vector2d(width, length));
    builder.add_box({{centre.x() - half.x(), centre.y() - half.y(), bottom},
                     {centre.x() + half.x(), centre.y() + half.y(), top}},
                    0.0,
                    Style::kMetal);
  };
  add(4.0, 1.6, 0.0, 0.85);
  add(2.1, 1.45, 0.85, 1.4);
}

void add_street_furniture(WorldBuilder& builder, const Side& side, Rng& rng) {
  for (const double to_left : {-5.0, 5.0}) {
    for (double s = rng.uniform(5.0, 9.0); s < side.length - 5.0; s += rng.uniform(6.0, 9.0)) {
      if (rng.below(3) == 0) {
        builder.add_cylinder(side.at(s, to_left, 0.0), 0.09, 5.0, Style::kMetal);
      } else {
        add_tree(builder, side.at(s, to_left, 0.0), rng);
      }
    }
    for (double s = rng.uniform(9.0, 13.0); s < side.length - 9.0; s += rng.uniform(6.0, 11.0)) {
      add_parked_car(builder, side, s, to_left > 0.0 ? 3.1 : -3.1);
    }
  }
}

}  // namespace

World make_street(std::uint64_t seed) {
  WorldBuilder builder(seed, kTexelM);
  Rng rng(seed, 1);
  add_ground(builder);
  for (const Side& side : kSides) {
    add_houses(builder, side, rng);
    add_street_furniture(builder, side, rng);
  }
  return builder.build("street");
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/testing/town.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"

namespace waymark {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTopOfHousesM = -8.0;
constexpr double kGroundM = 1.6;
constexpr double kReliefM = 0.5;
/// Sizes suit cameras of such pixels up to distances between these, from a quarter of that on.
constexpr double kTownPixelRad = 0.0024;
constexpr double kLeastReachM = 6.0;
constexpr double kMostReachM = 70.0;

/// Streams of random numbers.
enum TownStream : std::uint64_t { kCrossingStream, kHouseStream, kFirstFacadeStream };

Vector3d on_ground(const Vector2d& plan, double y) { return {plan.x(), y, plan.y()}; }

Vector2d right_of(const Vector2d& direction) { return {direction.y(), -direction.x()}; }

/// Above 0 where c is on one side of the line from a to b.
double side_of(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  const Vector2d along = b - a;
  const Vector2d off = c - a;
  return along.x() * off.y() - along.y() * off.x();
}

FacadePoint random_point(Rng& rng) {
  FacadePoint point;
  point.along = static_cast<float>(rng.uniform());
  point.y_m = static_cast<float>(rng.uniform(kTopOfHousesM, kGroundM));
  point.relief_m = static_cast<float>(kReliefM * rng.uniform());
  point.angle_rad = static_cast<float>(rng.uniform(-std::numbers::pi, std::numbers::pi));
  const double reach_m = kLeastReachM * std::pow(kMostReachM / kLeastReachM, rng.uniform());
  point.size_m = static_cast<float>(kTownPixelRad * reach_m);
  point.response = static_cast<float>(rng.uniform());
  for (std::uint64_t& word : point.descriptor) word = rng.next();
  return point;
}

}  // namespace

/// Who looks through which openings.
struct Town::Sight {
  /// An opening between houses.
  struct Gate {
    Vector2d left, right;
    bool shows(const Vector2d& eye, const Vector2d& point) const {
      return side_of(eye, point, left) * side_of(eye, point, right) < 0.0;
    }
  };

  Vector2d eye;
  Vector2d forward;
  double max_distance_m;
  std::array<Gate, 2> gates = {};
  std::size_t num_gates = 0;

  bool reaches(const Vector2d& point, double margin_m) const {
    const Vector2d ray = point - eye;
    return ray.squaredNorm() <= std::pow(max_distance_m + margin_m, 2) &&
           ray.dot(forward) >= -margin_m;
  }
  bool shows(const Vector2d& point) const {
    if (!reaches(point, 0.0)) return false;
    for (std::size_t i = 0; i < num_gates; ++i) {
      if (!gates[i].shows(eye, point)) return false;
    }
    return true;
  }
};

Town::Town(const TownSettings& settings) : settings_(settings) {
  WAYMARK_CHECK(settings.num_columns >= 2 && settings.num_rows >= 2 && settings.num_alike > 0);
  WAYMARK_CHECK(settings.jitter >= 0.0 && settings.jitter <= 0.2);
  WAYMARK_CHECK(settings.block_m > 4.0 * settings.street_width_m);
  points_per_house_ = static_cast<std::uint32_t>(
      std::max(1.0, std::round(settings.points_per_m * settings.house_m)));
  lay_streets();
  paint_facades();
}

void Town::lay_streets() {
  Rng rng(settings_.seed, kCrossingStream);
  const double off = settings_.jitter * settings_.block_m;
  for (int row = 0; row < settings_.num_rows; ++row) {
    for (int column = 0; column < settings_.num_columns; ++column) {
      const double x = settings_.block_m * column + rng.uniform(-off, off);
      crossings_.emplace_back(x, settings_.block_m * row + rng.uniform(-off, off));
    }
  }
  streets_at_.resize(crossings_.size());
  const auto width = static_cast<std::uint32_t>(settings_.num_columns);
  const auto count = static_cast<std::uint32_t>(crossings_.size());
  ends_at_.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (i % width + 1 < width) add_street(i, i + 1);
    if (i + width < count) add_street(i, i + width);
    if (i % width == 0) close_crossing(i, -Vector2d::UnitX());
    if (i % width + 1 == width) close_crossing(i, Vector2d::UnitX());
    if (i < width) close_crossing(i, -Vector2d::UnitY());
    if (i + width >= count) close_crossing(i, Vector2d::UnitY());
  }
}

void Town::add_street(std::uint32_t from, std::uint32_t to) {
  Street street;
  street.from = from;
  street.to = to;
  street.direction = (crossings_[to] - crossings_[from]).normalized();
  street.begin = crossings_[from] + corner_m() * street.direction;
  street.end = crossings_[to] - corner_m() * street.direction;
  const Vector2d half = 0.5 * settings_.street_width_m * right_of(street.direction);
  const Vector2d normal = half.normalized();
  street.rows = {add_row(street.begin + half, street.end + half, -normal),
                 add_row(street.begin - half, street.end - half, normal)};
  const auto index = static_cast<std::uint32_t>(streets_.size());
  streets_at_[from].push_back(index);
  streets_at_[to].push_back(index);
  streets_.push_back(street);
}

Town::Row Town::add_row(const Vector2d& begin, const Vector2d& end, const Vector2d& normal) {
  Rng rng(settings_.seed ^ houses_.size(), kHouseStream);
  const Vector2d length = end - begin;
  Row row;
  row.first_house = static_cast<std::uint32_t>(houses_.size());
  row.num_houses =
      std::max(1u, static_cast<std::uint32_t>(std::lround(length.norm() / settings_.house_m)));
  for (std::uint32_t i = 0; i < row.num_houses; ++i) {
    House house;
    house.along = length / row.num_houses;
    house.begin = begin + i * house.along;
    house.normal = normal;
    const bool is_alike = rng.uniform() < settings_.repeated_share;
    const auto own = settings_.num_alike + static_cast<std::uint32_t>(houses_.size());
    house.facade = is_alike ? rng.below(settings_.num_alike) : own;
    houses_.push_back(house);
  }
  return row;
}

/// Where the town ends a front stands across what would be the next street.
void Town::close_crossing(std::uint32_t crossing, const Vector2d& outward) {
  const Vector2d middle = crossings_[crossing] + corner_m() * outward;
  const Vector2d half = 0.5 * settings_.street_width_m * right_of(outward);
  ends_at_[crossing].push_back(add_row(middle - half, middle + half, -outward));
}

/// Facades are numbered anew, so that there are as many as are in use.
void Town::paint_facades() {
  std::vector<std::uint32_t> number_of_alike(settings_.num_alike, TownPlace::kNone);
  std::uint32_t num_facades = 0;
  for (House& house : houses_) {
    const std::uint32_t look = house.facade;
    const bool is_alike = look < settings_.num_alike;
    if (is_alike && number_of_alike[look] != TownPlace::kNone) {
      house.facade = number_of_alike[look];
      continue;
    }
    house.facade = num_facades++;
    if (is_alike) number_of_alike[look] = house.facade;
    Rng rng(settings_.seed, kFirstFacadeStream + look);
    for (std::uint32_t i = 0; i < points_per_house_; ++i)
      facade_points_.push_back(random_point(rng));
  }
}

Town::Point Town::point(std::uint32_t id) const {
  const House& house = houses_[id / points_per_house_];
  const FacadePoint& look =
      facade_points_[house.facade * points_per_house_ + id % points_per_house_];
  Point point;
  const double relief = look.relief_m;
  point.position =
      on_ground(house.begin + look.along * house.along + relief * house.normal, look.y_m);
  point.normal = on_ground(house.normal, 0.0);
  point.along = on_ground(house.along.normalized(), 0.0);
  const double angle = look.angle_rad;
  point.tangent = std::cos(angle) * point.along + std::sin(angle) * Vector3d::UnitY();
  point.look = &look;
  return point;
}

Descriptor Town::look_from(const Point& point, const Vector3d& eye) const {
  const double end = 0.5 * (1.0 + (eye - point.position).normalized().dot(point.along));
  auto num_others = static_cast<int>(std::lround(256.0 * settings_.turned_share * end));
  Descriptor look = point.look->descriptor;
  Rng other(look[0], look[1]);
  for (std::uint64_t& word : look) {
    const int count = std::clamp(num_others, 0, 64);
    const std::uint64_t mask = count == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1;
    word = (word & ~mask) | (other.next() & mask);
    num_others -= count;
  }
  return look;
}

void Town::list_of_row(const Row& row, const Sight& sight, std::vector<std::uint32_t>& ids) const {
  for (std::uint32_t i = 0; i < row.num_houses; ++i) {
    const std::uint32_t number = row.first_house + i;
    const House& house = houses_[number];
    if (!sight.reaches(house.begin + 0.5 * house.along, settings_.house_m)) continue;
    const FacadePoint* looks = &facade_points_[house.facade * points_per_house_];
    for (std::uint32_t k = 0; k < points_per_house_; ++k) {
      const Vector2d at =
          house.begin + looks[k].along * house.along + double{looks[k].relief_m} * house.normal;
      if (sight.shows(at)) ids.push_back(number * points_per_house_ + k);
    }
  }
}

/// Lists the points at a crossing, and those of its streets, which are seen through their ends.
void Town::look_across(std::uint32_t crossing,
                       std::uint32_t except,
                       Sight& sight,
                       std::vector<std::uint32_t>& ids) const {
  for (const Row& row : ends_at_[crossing]) list_of_row(row, sight, ids);
  Sight::Gate& gate = sight.gates[sight.num_gates++];
  for (const std::uint32_t index : streets_at_[crossing]) {
    if (index == except) continue;
    const Street& street = streets_[index];
    const Vector2d& middle = street.from == crossing ? street.begin : street.end;
    const Vector2d half = 0.5 * settings_.street_width_m * right_of(street.direction);
    gate = {middle - half, middle + half};
    for (const Row& row : street.rows) list_of_row(row, sight, ids);
  }
  --sight.num_gates;
}

void Town::list_in_sight(const TownPlace& place,
                         const Vector2d& eye,
                         const Vector2d& forward,
                         double max_distance_m,
                         std::vector<std::uint32_t>& ids) const {
  ids.clear();
  Sight sight{eye, forward, max_distance_m};
  if (place.street == TownPlace::kNone) {
    look_across(place.crossing, TownPlace::kNone, sight, ids);
    return;
  }
  const Street& street = streets_[place.street];
  for (const Row& row : street.rows) list_of_row(row, sight, ids);
  const Vector2d half = 0.5 * settings_.street_width_m * right_of(street.direction);
  for (const bool is_end : {false, true}) {
    const Vector2d& middle = is_end ? street.end : street.begin;
    sight.gates[0] = {middle - half, middle + half};
    sight.num_gates = 1;
    look_across(is_end ? street.to : street.from, place.street, sight, ids);
  }
}

}  // namespace waymark

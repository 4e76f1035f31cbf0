// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "waymark/features/features.h"

namespace waymark {

/// What a town is like. Ground plans are (x, z) in metres; y points down and is 0 at the height of
/// the cameras.
struct TownSettings {
  std::uint64_t seed = 1;
  int num_columns = 4;           ///< Of crossings, along x; at least 2.
  int num_rows = 4;              ///< Along z; at least 2.
  double block_m = 60.0;         ///< Between crossings.
  double jitter = 0.08;          ///< By which crossings are off, per axis, in parts of block_m.
  double street_width_m = 12.0;  ///< From front to front.
  double house_m = 8.0;          ///< Width of a front, about.
  double points_per_m = 24.0;    ///< Of a front.
  double repeated_share = 0.0;   ///< Of the houses, which have one of num_alike facades.
  std::uint32_t num_alike = 4;   ///< Facades that are repeated.
  double turned_share = 0.6;     ///< Of the bits of a look, which depend on where one stands.
};

/// A corner on a front.
struct FacadePoint {
  float along = 0.0f;      ///< Along the front, in parts of its width.
  float y_m = 0.0f;        ///< Down.
  float relief_m = 0.0f;   ///< Out of the wall.
  float angle_rad = 0.0f;  ///< Of its tangent in the wall.
  float size_m = 0.0f;     ///< Of what covers one pixel of its level.
  float response = 0.0f;   ///< 0 to 1.
  Descriptor descriptor{};
};

/// Where one stands: in a street between its crossings, or in a crossing.
struct TownPlace {
  static constexpr std::uint32_t kNone = UINT32_MAX;
  std::uint32_t street = kNone;
  std::uint32_t crossing = kNone;  ///< If in no street.
};

/// Streets between the crossings of a grid that is not quite regular, with a row of houses on
/// either side, whose fronts carry points. The same settings give the same town. Its size is that
/// of its fronts: some 60 bytes per point. Immutable.
class Town {
 public:
  /// Fronts side by side.
  struct Row {
    std::uint32_t first_house = 0;
    std::uint32_t num_houses = 0;
  };

  /// A street in the order from crossing, to crossing.
  struct Street {
    std::uint32_t from = 0;
    std::uint32_t to = 0;
    Eigen::Vector2d direction;   ///< Unit.
    Eigen::Vector2d begin, end;  ///< Between which the houses stand, in the middle of the street.
    std::array<Row, 2> rows;     ///< On either side.
  };

  /// A point of a front as it stands in the world.
  struct Point {
    Eigen::Vector3d position;
    Eigen::Vector3d normal;   ///< Into the street.
    Eigen::Vector3d along;    ///< Along the front.
    Eigen::Vector3d tangent;  ///< Gives the orientation of features.
    const FacadePoint* look = nullptr;
  };

  explicit Town(const TownSettings& settings);

  const std::vector<Eigen::Vector2d>& crossings() const { return crossings_; }
  const std::vector<Street>& streets() const { return streets_; }
  /// Streets that meet in a crossing, ascending.
  const std::vector<std::uint32_t>& streets_at(std::uint32_t crossing) const {
    return streets_at_[crossing];
  }
  /// From the middle of a crossing to the first houses.
  double corner_m() const { return 0.75 * settings_.street_width_m; }
  std::uint32_t num_points() const {
    return static_cast<std::uint32_t>(houses_.size()) * points_per_house_;
  }
  /// id: below num_points().
  Point point(std::uint32_t id) const;
  /// Which facade the house of a point has: houses of one facade look the same.
  std::uint32_t facade_of(std::uint32_t id) const { return houses_[id / points_per_house_].facade; }
  /// What a point looks like from somewhere: a part of its bits is another seen from one end of the
  /// street than from the other, and changes evenly between.
  Descriptor look_from(const Point& point, const Eigen::Vector3d& eye) const;

  /// Points that no house hides from who stands at a place, at most so far away; those behind are
  /// left out where there is a forward (else zero). Of streets, that with the eye in it and those
  /// next to it. Time does not depend on the size of the town.
  void list_in_sight(const TownPlace& place,
                     const Eigen::Vector2d& eye,
                     const Eigen::Vector2d& forward,
                     double max_distance_m,
                     std::vector<std::uint32_t>& ids) const;

 private:
  struct House {
    Eigen::Vector2d begin;
    Eigen::Vector2d along;  ///< Of the length of the front.
    Eigen::Vector2d normal;
    std::uint32_t facade = 0;
  };
  struct Sight;

  void lay_streets();
  void add_street(std::uint32_t from, std::uint32_t to);
  Row add_row(const Eigen::Vector2d& begin,
              const Eigen::Vector2d& end,
              const Eigen::Vector2d& normal);
  void close_crossing(std::uint32_t crossing, const Eigen::Vector2d& outward);
  void paint_facades();
  void list_of_row(const Row& row, const Sight& sight, std::vector<std::uint32_t>& ids) const;
  void look_across(std::uint32_t crossing,
                   std::uint32_t except,
                   Sight& sight,
                   std::vector<std::uint32_t>& ids) const;

  TownSettings settings_;
  std::uint32_t points_per_house_;
  std::vector<Eigen::Vector2d> crossings_;
  std::vector<Street> streets_;
  std::vector<std::vector<std::uint32_t>> streets_at_;
  std::vector<std::vector<Row>> ends_at_;  ///< Per crossing.
  std::vector<House> houses_;
  std::vector<FacadePoint> facade_points_;  ///< points_per_house_ of each facade.
};

}  // namespace waymark

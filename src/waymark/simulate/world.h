// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/geometry/rigid3.h"
#include "waymark/image/image.h"

namespace waymark {

/// A grey image on a surface, with its mip levels (Williams 1983), addressed in metres.
class Texture {
 public:
  /// The image covers [0, width * texel_m) x [0, height * texel_m). With wraps_u its columns
  /// repeat.
  Texture(Image base, double texel_m, bool wraps_u);

  /// Mean grey over the parallelogram around centre_m with the edges edge_a_m and edge_b_m: the
  /// footprint of a pixel. Long footprints are read at several places along their longer edge, so
  /// that grazing views stay sharp (after Feline, McCormack et al. 1999).
  float sample(const Eigen::Vector2f& centre_m,
               const Eigen::Vector2f& edge_a_m,
               const Eigen::Vector2f& edge_b_m) const;

  /// Width of a texel of level 0.
  double texel_m() const { return texel_m_; }

 private:
  /// Places along a line, in texels of level 0.
  struct Probes {
    Eigen::Vector2f first;
    Eigen::Vector2f step;
    int count;
  };

  template <bool kWraps>
  float mean(int level, const Probes& probes) const;

  std::vector<Image> levels_;
  double texel_m_;
  float texels_per_metre_;
  bool wraps_u_;
};

/// The shapes there are.
enum class SurfaceKind : std::uint8_t { kRectangle, kDisc, kCylinder, kSphere };

/// Whether it is that of a cylinder or a sphere.
constexpr bool is_round(SurfaceKind kind) {
  return kind == SurfaceKind::kCylinder || kind == SurfaceKind::kSphere;
}

/// A textured analytic surface, seen from its outer side only. Surface coordinates (u, v) are in
/// metres; seen from outside, u runs to the right and v down, hence normal = v_axis x u_axis.
struct Surface {
  SurfaceKind kind = SurfaceKind::kRectangle;  ///< Its shape.
  /// Rectangle and disc: the corner u = v = 0 (of the square around the disc). Cylinder: the centre
  /// of the upper end. Sphere: the centre. World frame.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  /// Unit and orthogonal, in the world frame. The axis of a cylinder or sphere is -v_axis; there
  /// u_axis and -normal() are where the angles 0 and 90 degrees point to.
  Eigen::Vector3d u_axis = Eigen::Vector3d::UnitX();
  Eigen::Vector3d v_axis = -Eigen::Vector3d::UnitZ();  ///< As u_axis: unit, in the world frame.
  Eigen::Vector2d size = Eigen::Vector2d::Ones();      ///< Extent in u and v.
  double radius = 0.0;                                 ///< Of disc, cylinder and sphere.
  std::uint32_t texture = 0;                           ///< Index in the world's textures.

  /// v_axis x u_axis, unit: of a rectangle or disc the outward normal.
  Eigen::Vector3d normal() const { return v_axis.cross(u_axis); }
};

/// Makers of surfaces; the axes as in Surface.
Surface make_rectangle(const Eigen::Vector3d& corner,
                       const Eigen::Vector3d& u_axis,
                       const Eigen::Vector3d& v_axis,
                       const Eigen::Vector2d& size);
/// Disc that faces normal.
Surface make_disc(const Eigen::Vector3d& centre, const Eigen::Vector3d& normal, double radius);
/// Upright cylinder without its ends.
Surface make_cylinder(const Eigen::Vector3d& base_centre, double radius, double height);
/// Sphere whose poles are above each other.
Surface make_sphere(const Eigen::Vector3d& centre, double radius);

/// Where a ray meets a surface.
struct SurfaceHit {
  double distance = 0.0;                         ///< In multiples of the length of the direction.
  Eigen::Vector2d uv = Eigen::Vector2d::Zero();  ///< Surface coordinates, in metres.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< Unit, outward, in the world frame.
};

/// First meeting of the ray origin + t * direction, t > 0, with the outer side of the surface, in
/// closed form; nothing if there is none. The edges of rectangles give by 0.1 mm, which closes the
/// seams between neighbours.
std::optional<SurfaceHit> intersect(const Surface& surface,
                                    const Eigen::Vector3d& origin,
                                    const Eigen::Vector3d& direction);

/// World point of surface coordinates (u, v).
Eigen::Vector3d surface_point(const Surface& surface, const Eigen::Vector2d& uv);
/// The outward normal at surface coordinates (u, v), unit, in the world frame.
Eigen::Vector3d surface_normal(const Surface& surface, const Eigen::Vector2d& uv);

/// How far the edges of rectangles give, see intersect().
inline constexpr double kSeamM = 1e-4;

/// Where a ray meets the world.
struct WorldHit {
  std::uint32_t surface = 0;  ///< Index in World::surfaces.
  SurfaceHit hit;             ///< Where on it.
};

/// Somebody who walks straight on, or something that stands still: surfaces that are there from one
/// time to another.
struct Pedestrian {
  std::uint32_t first_surface = 0;  ///< Indices in World::surfaces, where they stand at the origin.
  std::uint32_t end_surface = 0;    ///< One past the last of them.
  double start_s = 0.0;             ///< They are there from this time ...
  double end_s = 0.0;               ///< ... to this one.
  Eigen::Vector3d start = Eigen::Vector3d::Zero();     ///< Of the feet, in the world.
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< In m/s.
};

/// Surfaces fixed to something that moves, in whose axes they are given.
struct DynamicObject {
  std::uint32_t first_surface = 0;                       ///< Indices in World::surfaces.
  std::uint32_t end_surface = 0;                         ///< One past the last of them.
  std::function<Rigid3(double time_s)> world_from_part;  ///< Defined at any time.
};

/// Textured analytic surfaces; z points up, the ground is near z = 0. Immutable once made.
struct World {
  std::string name;                    ///< As make_world() knows it.
  std::vector<Surface> surfaces;       ///< In no order.
  std::vector<Texture> textures;       ///< That surfaces refer to by index.
  std::vector<Pedestrian> walks;       ///< Of surfaces that move, come or go.
  std::vector<DynamicObject> carried;  ///< Likewise; no surface is in both.

  /// The surfaces where they are at a time; those of walks that are not there lie below the world.
  std::vector<Surface> surfaces_at(double time_s) const;

  /// The nearest surface along origin + t * direction, t > 0; nothing where there is only sky.
  std::optional<WorldHit> intersect(const Eigen::Vector3d& origin,
                                    const Eigen::Vector3d& direction) const;
};

/// Names that make_world() knows:
///   room       one furnished room, 6 x 5 m
///   apartment  four rooms of 4 x 3.5 m in a ring of doors
///   hall       24 x 16 x 7 m with columns and crates
///   street     a block of houses to drive around, 40 x 28 m
///   twins      two rooms that look exactly alike, with a corridor that does not
///   bare       the room with hardly any texture on its walls
///   blank      the apartment with blank walls, floors and ceilings
///   corridor   50 m with 20 doors that look exactly alike
///   shop       24 x 16 m with eight shelves that look exactly alike
std::vector<std::string> world_names();

/// Makes a named world; the same name and seed give the same world. Throws InputError for an
/// unknown name.
std::shared_ptr<const World> make_world(std::string_view name, std::uint64_t seed);

}  // namespace waymark

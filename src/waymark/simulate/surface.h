// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>

namespace waymark {

/// The shapes there are.
enum class SurfaceKind : std::uint8_t { kRectangle, kDisc, kCylinder, kSphere };

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

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>

namespace waymark {

enum class SurfaceKind : std::uint8_t { kRectangle, kDisc, kCylinder, kSphere };

/// A textured analytic surface, seen from its outer side only. Surface coordinates (u, v) are in
/// metres; seen from outside, u runs to the right and v down, hence normal = v_axis x u_axis.
struct Surface {
  SurfaceKind kind = SurfaceKind::kRectangle;
  /// Rectangle and disc: the corner u = v = 0 (of the square around the disc). Cylinder: the centre
  /// of the upper end. Sphere: the centre. World frame.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  /// Unit and orthogonal, in the world frame. The axis of a cylinder or sphere is -v_axis; there
  /// u_axis and -normal() are where the angles 0 and 90 degrees point to.
  Eigen::Vector3d u_axis = Eigen::Vector3d::UnitX();
  Eigen::Vector3d v_axis = -Eigen::Vector3d::UnitZ();
  Eigen::Vector2d size = Eigen::Vector2d::Ones();  ///< Extent in u and v.
  double radius = 0.0;                             ///< Of disc, cylinder and sphere.
  std::uint32_t texture = 0;                       ///< Index in the world's textures.

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
Surface make_sphere(const Eigen::Vector3d& centre, double radius);

/// Where a ray meets a surface.
struct SurfaceHit {
  double distance = 0.0;  ///< In multiples of the length of the direction.
  Eigen::Vector2d uv = Eigen::Vector2d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< Unit, outward, in the world frame.
};

/// First meeting of the ray origin + t * direction, t > 0, with the outer side of the surface, in
/// closed form; nothing if there is none. The edges of rectangles give by 0.1 mm, which closes the
/// seams between neighbours.
std::optional<SurfaceHit> intersect(const Surface& surface,
                                    const Eigen::Vector3d& origin,
                                    const Eigen::Vector3d& direction);

/// World point of surface coordinates (u, v), and the outward normal there.
Eigen::Vector3d surface_point(const Surface& surface, const Eigen::Vector2d& uv);
Eigen::Vector3d surface_normal(const Surface& surface, const Eigen::Vector2d& uv);

/// How far the edges of rectangles give, see intersect().
inline constexpr double kSeamM = 1e-4;

}  // namespace waymark

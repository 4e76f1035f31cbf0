// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/triangulation.h"

#include <cmath>

#include "waymark/geometry/bearing.h"

namespace waymark {

std::optional<Eigen::Vector3d> triangulate(const Eigen::Vector3d& bearing_a,
                                           const Eigen::Vector3d& bearing_b,
                                           const Rigid3& a_from_b,
                                           double min_parallax_rad) {
  // Both rays in frame a: the first from its origin, the second from t.
  const Eigen::Vector3d ray_b = a_from_b.rotation * bearing_b;
  const Eigen::Vector3d& t = a_from_b.translation;
  const double p = bearing_a.cross(ray_b).norm();
  const double q = bearing_a.cross(t).norm();
  const double r = ray_b.cross(t).norm();
  if (!(p > 0.0) || p < std::sin(min_parallax_rad) || !(q + r > 0.0)) return std::nullopt;

  // By the law of sines, the points on both rays at equal angular error.
  const Eigen::Vector3d along_a = r / p * bearing_a;
  const Eigen::Vector3d along_b = q / p * ray_b;
  // In front of both, if reversing a ray (or both) does not bring its end nearer to the other's.
  const double gap = (t + along_b - along_a).squaredNorm();
  if (gap >= (t + along_b + along_a).squaredNorm() ||
      gap >= (t - along_b - along_a).squaredNorm() ||
      gap >= (t - along_b + along_a).squaredNorm()) {
    return std::nullopt;
  }
  // Weighted by inverse distances, p / r and p / q.
  return (q * along_a + r * (t + along_b)) / (q + r);
}

double parallax_angle(const Eigen::Vector3d& bearing_a,
                      const Eigen::Vector3d& bearing_b,
                      const Rigid3& a_from_b) {
  return angle_between(bearing_a, a_from_b.rotation * bearing_b);
}

}  // namespace waymark

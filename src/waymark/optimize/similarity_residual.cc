// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/similarity_residual.h"

#include <cmath>

#include "waymark/geometry/so3.h"
#include "waymark/optimize/residual.h"

namespace waymark {
namespace {

/// One camera's view of the other's landmark.
struct SideView {
  InverseRangePoint seen;
  Eigen::Vector2d residual;
};

std::optional<SideView> view(const Eigen::Vector3d& point_in_cam,
                             const LandmarkMatches::Side& side,
                             std::size_t index) {
  const InverseRangePoint seen = in_inverse_range(point_in_cam);
  if (!is_ahead(seen, side.bearing[index])) return std::nullopt;
  const Eigen::Vector2d residual =
      bearing_residual(seen, side.bearing[index], side.level_pixel_from_bearing[index]);
  if (!residual.allFinite()) return std::nullopt;
  return SideView{seen, residual};
}

/// Of a point by a left perturbation that acts on it: rho + phi x p + sigma p.
Eigen::Matrix<double, 3, 7> point_by_perturbation(const Eigen::Vector3d& point) {
  Eigen::Matrix<double, 3, 7> result;
  result << Eigen::Matrix3d::Identity(), -skew(point), point;
  return result;
}

}  // namespace

std::optional<SimilarityResidual> similarity_residual(const Sim3& b_from_a,
                                                      const LandmarkMatches& matches,
                                                      std::size_t index) {
  const Sim3 a_from_b = b_from_a.inverse();
  const Eigen::Vector3d& from_b = matches.b.point_in_cam[index];
  const Eigen::Vector3d point_in_b = b_from_a * matches.a.point_in_cam[index];
  const auto in_b = view(point_in_b, matches.b, index);
  const auto in_a = view(a_from_b * from_b, matches.a, index);
  if (!in_a || !in_b) return std::nullopt;
  SimilarityResidual result;
  result.value << in_b->residual, in_a->residual;
  result.jacobian.topRows<2>() =
      bearing_residual_by_point(in_b->seen, matches.b.level_pixel_from_bearing[index]) *
      point_by_perturbation(point_in_b);
  // (exp(xi) S)^-1 p = S^-1 (exp(-xi) p).
  const Matrix23d by_point_in_b =
      bearing_residual_by_point(in_a->seen, matches.a.level_pixel_from_bearing[index]) *
      (a_from_b.scale * a_from_b.rotation.toRotationMatrix());
  result.jacobian.bottomRows<2>() = -by_point_in_b * point_by_perturbation(from_b);
  result.log_range_ratio = -std::log(from_b.norm() * in_b->seen.inverse_range);
  result.log_range_jacobian = in_b->seen.inverse_range * in_b->seen.direction.transpose() *
                              point_by_perturbation(point_in_b);
  if (!std::isfinite(result.log_range_ratio)) return std::nullopt;
  return result;
}

double squared_similarity_residual(const Sim3& b_from_a,
                                   const Sim3& a_from_b,
                                   const LandmarkMatches& matches,
                                   std::size_t index) {
  const auto in_b = view(b_from_a * matches.a.point_in_cam[index], matches.b, index);
  if (!in_b) return kGrossSquaredResidual;
  const auto in_a = view(a_from_b * matches.b.point_in_cam[index], matches.a, index);
  if (!in_a) return kGrossSquaredResidual;
  return in_b->residual.squaredNorm() + in_a->residual.squaredNorm();
}

}  // namespace waymark

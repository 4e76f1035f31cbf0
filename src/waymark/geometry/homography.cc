// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/homography.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "waymark/geometry/robust_loss.h"

namespace waymark {
namespace {

// Volume of three unit bearings below which they count as coplanar.
constexpr double kMinVolume = 1e-9;

// The map of the four unit vectors (1,0,0), (0,1,0), (0,0,1), (1,1,1) to four bearings, each up to
// a factor: columns are the first three bearings, scaled to sum to the fourth.
std::optional<Eigen::Matrix3d> projective_basis(std::span<const Eigen::Vector3d, 4> bearings) {
  Eigen::Matrix3d basis;
  basis << bearings[0], bearings[1], bearings[2];
  if (!(std::abs(basis.determinant()) > kMinVolume)) return std::nullopt;
  const Eigen::Vector3d factors = basis.inverse() * bearings[3];
  if (!(factors.cwiseAbs().minCoeff() > kMinVolume)) return std::nullopt;
  return basis * factors.asDiagonal();
}

// The displaced bearing H a in the tangent plane of b, in the coordinates of tangent_basis(b).
struct Transfer {
  Eigen::Vector2d residual;
  double depth_ratio;
  Eigen::Matrix<double, 2, 3> residual_from_image;  // derivative by H a
};

Transfer transfer(const Eigen::Matrix3d& homography,
                  const Eigen::Vector3d& a,
                  const Eigen::Vector3d& b) {
  const Eigen::Vector3d image = homography * a;
  const Eigen::Matrix<double, 2, 3> tangent = tangent_basis(b).transpose();
  Transfer result;
  result.depth_ratio = b.dot(image);
  result.residual = tangent * image / result.depth_ratio;
  result.residual_from_image = (tangent - result.residual * b.transpose()) / result.depth_ratio;
  return result;
}

}  // namespace

std::optional<Eigen::Matrix3d> solve_four_point(std::span<const Eigen::Vector3d, 4> bearings_a,
                                                std::span<const Eigen::Vector3d, 4> bearings_b) {
  const std::optional<Eigen::Matrix3d> basis_a = projective_basis(bearings_a);
  const std::optional<Eigen::Matrix3d> basis_b = projective_basis(bearings_b);
  if (!basis_a || !basis_b) return std::nullopt;
  Eigen::Matrix3d homography = *basis_b * basis_a->inverse();
  homography.normalize();
  if (bearings_b[0].dot(homography * bearings_a[0]) < 0.0) homography = -homography;
  for (int i = 1; i < 4; ++i) {
    if (!(bearings_b[i].dot(homography * bearings_a[i]) > 0.0)) return std::nullopt;
  }
  return homography;
}

double squared_homography_error(const Eigen::Matrix3d& homography,
                                const BearingMatches& matches,
                                std::size_t index) {
  const Eigen::Vector3d& a = matches.bearings_a[index];
  const Transfer transferred = transfer(homography, a, matches.bearings_b[index]);
  if (!(transferred.depth_ratio > 0.0)) return std::numeric_limits<double>::infinity();
  // Covariance of the residual: noise of b, and of a carried over by H.
  const Eigen::Matrix2d by_a = transferred.residual_from_image * homography * tangent_basis(a);
  const double variance_a = matches.sigmas_rad_a[index] * matches.sigmas_rad_a[index];
  const double variance_b = matches.sigmas_rad_b[index] * matches.sigmas_rad_b[index];
  Eigen::Matrix2d covariance = variance_a * by_a * by_a.transpose();
  covariance.diagonal().array() += variance_b;
  const Eigen::Vector2d& r = transferred.residual;
  // r^T covariance^-1 r, written out for 2x2.
  return (covariance(1, 1) * r.x() * r.x() - 2.0 * covariance(0, 1) * r.x() * r.y() +
          covariance(0, 0) * r.y() * r.y()) /
         covariance.determinant();
}

std::optional<Eigen::Matrix3d> refine_homography(const Eigen::Matrix3d& homography,
                                                 const BearingMatches& matches,
                                                 std::span<const std::uint32_t> indices) {
  constexpr int kIterations = 4;
  constexpr double kSquaredScale = 9.0;
  if (indices.size() < 4) return std::nullopt;
  Eigen::Matrix3d h = homography;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Eigen::Matrix<double, 9, 9> information = Eigen::Matrix<double, 9, 9>::Zero();
    Eigen::Matrix<double, 9, 1> gradient = Eigen::Matrix<double, 9, 1>::Zero();
    for (const std::uint32_t index : indices) {
      const Eigen::Vector3d& a = matches.bearings_a[index];
      const Transfer transferred = transfer(h, a, matches.bearings_b[index]);
      if (!(transferred.depth_ratio > 0.0)) continue;
      const Eigen::Matrix2d by_a = transferred.residual_from_image * h * tangent_basis(a);
      const double sigma_a = matches.sigmas_rad_a[index], sigma_b = matches.sigmas_rad_b[index];
      const double variance = sigma_b * sigma_b + 0.5 * sigma_a * sigma_a * by_a.squaredNorm();
      const double weight =
          geman_mcclure_weight(transferred.residual.squaredNorm() / variance, kSquaredScale) /
          variance;
      Eigen::Matrix<double, 2, 9> jacobian;  // by the columns of H
      for (int k = 0; k < 3; ++k) {
        jacobian.middleCols<3>(3 * k) = a[k] * transferred.residual_from_image;
      }
      information += weight * jacobian.transpose() * jacobian;
      gradient += weight * jacobian.transpose() * transferred.residual;
    }
    // The scale of H has no effect; tying it makes the system regular.
    const Eigen::Map<const Eigen::Matrix<double, 9, 1>> scale_direction(h.data());
    information += information.trace() * scale_direction * scale_direction.transpose();
    const Eigen::Matrix<double, 9, 1> step = information.ldlt().solve(-gradient);
    if (!step.allFinite()) return std::nullopt;
    h += Eigen::Map<const Eigen::Matrix3d>(step.data());
    h.normalize();
  }
  return h;
}

std::vector<PlanarMotion> decompose_homography(const Eigen::Matrix3d& homography) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(homography.transpose() * homography);
  // Scaled so that the middle singular value is one; ascending order.
  const double middle = solver.eigenvalues()[1];
  // Both views are on the same side of the plane, so H keeps the orientation.
  if (!(middle > 0.0) || !(homography.determinant() > 0.0)) return {};
  const Eigen::Matrix3d h = homography / std::sqrt(middle);
  const Eigen::Vector3d squared_singular = solver.eigenvalues() / middle;
  const double below = std::max(0.0, 1.0 - squared_singular[0]);
  const double above = std::max(0.0, squared_singular[2] - 1.0);

  constexpr double kRotationTolerance = 1e-12;
  if (above + below < kRotationTolerance) {
    return {
        {{Eigen::Quaterniond(h).normalized(), Eigen::Vector3d::Zero()}, Eigen::Vector3d::UnitZ()}};
  }
  // H preserves lengths in the two planes spanned by v2 and u (Ma et al. 2004, proof of
  // theorem 5.19), so it turns a basis of such a plane as the rotation does.
  const Eigen::Vector3d v1 = solver.eigenvectors().col(2);
  const Eigen::Vector3d v2 = solver.eigenvectors().col(1);
  const Eigen::Vector3d v3 = solver.eigenvectors().col(0);
  std::vector<PlanarMotion> motions;
  for (const double sign : {1.0, -1.0}) {
    const Eigen::Vector3d u =
        (std::sqrt(below) * v1 + sign * std::sqrt(above) * v3) / std::sqrt(above + below);
    Eigen::Matrix3d before, after;
    before << v2, u, v2.cross(u);
    after << h * v2, h * u, (h * v2).cross(h * u);
    const Eigen::Matrix3d rotation = after * before.transpose();
    const Eigen::Vector3d normal = before.col(2);
    const Eigen::Vector3d translation = (h - rotation) * normal;
    const Eigen::Quaterniond q = Eigen::Quaterniond(rotation).normalized();
    motions.push_back({{q, translation}, normal});
    motions.push_back({{q, -translation}, -normal});
  }
  return motions;
}

}  // namespace waymark

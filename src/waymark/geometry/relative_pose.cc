// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/relative_pose.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "waymark/geometry/damping.h"
#include "waymark/geometry/essential.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/geometry/robust_loss.h"

namespace waymark {
namespace {

struct EpipolarSystem {
  Matrix5d information = Matrix5d::Zero();
  Vector5d gradient = Vector5d::Zero();
};

// Variance of c = b . (t x m) by the noise of b and of m = R a: for unit vectors, the gradient of c
// in the tangent plane of b has the squared length |t x m|^2 - c^2, and likewise for m; the product
// of both noises adds twice the product of the variances.
double epipolar_variance(double variance_a,
                         double variance_b,
                         double squared_t_cross_m,
                         double squared_t_cross_b,
                         double squared_c) {
  return variance_b * (squared_t_cross_m - squared_c) +
         variance_a * (squared_t_cross_b - squared_c) + 2.0 * variance_a * variance_b;
}

double robust_cost(const Rigid3& b_from_a,
                   const BearingMatches& matches,
                   std::span<const std::uint32_t> indices,
                   double squared_scale) {
  const Eigen::Matrix3d essential = essential_from_pose(b_from_a);
  double cost = 0.0;
  for (const std::uint32_t index : indices) {
    const double squared_error = squared_epipolar_error(essential, matches, index);
    cost += squared_error * squared_scale / (squared_error + squared_scale);
  }
  return cost;
}

EpipolarSystem linearise(const Rigid3& b_from_a,
                         const BearingMatches& matches,
                         std::span<const std::uint32_t> indices,
                         double squared_scale) {
  EpipolarSystem system;
  for (const std::uint32_t index : indices) {
    const EpipolarResidual residual = epipolar_residual(b_from_a, matches, index);
    const double weight = geman_mcclure_weight(residual.value * residual.value, squared_scale);
    system.information += weight * residual.jacobian * residual.jacobian.transpose();
    system.gradient += weight * residual.value * residual.jacobian;
  }
  return system;
}

// Levenberg-Marquardt at one scale of the loss.
Rigid3 descend(Rigid3 pose,
               const BearingMatches& matches,
               std::span<const std::uint32_t> indices,
               double squared_scale,
               int max_iterations) {
  double cost = robust_cost(pose, matches, indices, squared_scale);
  TenfoldDamping damping;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const EpipolarSystem system = linearise(pose, matches, indices, squared_scale);
    Rigid3 next = pose;
    double next_cost = cost;
    // Raise the damping until the step lowers the cost.
    for (; damping.is_below(1e6); damping.reject()) {
      Matrix5d damped = system.information;
      damped.diagonal() *= damping.factor();
      const Vector5d step = damped.ldlt().solve(-system.gradient);
      if (!step.allFinite()) return pose;
      next = perturb_relative_pose(pose, step);
      next_cost = robust_cost(next, matches, indices, squared_scale);
      if (next_cost < cost) break;
    }
    if (!(next_cost < cost)) break;
    const double gain = cost - next_cost;
    pose = next;
    cost = next_cost;
    damping.accept();
    if (gain < 1e-6 * cost) break;
  }
  return pose;
}

}  // namespace

double squared_epipolar_error(const Eigen::Matrix3d& essential,
                              const BearingMatches& matches,
                              std::size_t index) {
  const Eigen::Vector3d line_in_b = essential * matches.bearings_a[index];
  const Eigen::Vector3d line_in_a = essential.transpose() * matches.bearings_b[index];
  const double c = matches.bearings_b[index].dot(line_in_b);
  const double variance_a = matches.sigmas_rad_a[index] * matches.sigmas_rad_a[index];
  const double variance_b = matches.sigmas_rad_b[index] * matches.sigmas_rad_b[index];
  return c * c /
         epipolar_variance(
             variance_a, variance_b, line_in_b.squaredNorm(), line_in_a.squaredNorm(), c * c);
}

Rigid3 perturb_relative_pose(const Rigid3& b_from_a, const Vector5d& tangent) {
  const Eigen::Vector3d& t = b_from_a.translation;
  return {(so3_exp(tangent.head<3>()) * b_from_a.rotation).normalized(),
          (t + tangent_basis(t) * tangent.tail<2>()).normalized()};
}

EpipolarResidual epipolar_residual(const Rigid3& b_from_a,
                                   const BearingMatches& matches,
                                   std::size_t index) {
  const Eigen::Vector3d& b = matches.bearings_b[index];
  const Eigen::Vector3d& t = b_from_a.translation;
  const Eigen::Vector3d m = b_from_a.rotation * matches.bearings_a[index];
  const double variance_a = matches.sigmas_rad_a[index] * matches.sigmas_rad_a[index];
  const double variance_b = matches.sigmas_rad_b[index] * matches.sigmas_rad_b[index];
  const Eigen::Vector3d t_cross_m = t.cross(m);
  const Eigen::Vector3d b_cross_t = b.cross(t);
  const double c = b.dot(t_cross_m);
  const double variance = epipolar_variance(
      variance_a, variance_b, t_cross_m.squaredNorm(), b_cross_t.squaredNorm(), c * c);

  // Derivatives by m and t of c and of half the variance.
  const Eigen::Vector3d c_by_m = b_cross_t;
  const Eigen::Vector3d c_by_t = m.cross(b);
  const double by_squared_c = variance_a + variance_b;
  const Eigen::Vector3d variance_by_m = variance_b * t_cross_m.cross(t) - by_squared_c * c * c_by_m;
  const Eigen::Vector3d variance_by_t =
      variance_b * m.cross(t_cross_m) + variance_a * b_cross_t.cross(b) - by_squared_c * c * c_by_t;

  const double inverse_deviation = 1.0 / std::sqrt(variance);
  const Eigen::Vector3d by_m = inverse_deviation * (c_by_m - c / variance * variance_by_m);
  const Eigen::Vector3d by_t = inverse_deviation * (c_by_t - c / variance * variance_by_t);
  EpipolarResidual residual;
  residual.value = c * inverse_deviation;
  residual.jacobian.head<3>() = m.cross(by_m);  // dm = phi x m
  residual.jacobian.tail<2>() = tangent_basis(t).transpose() * by_t;
  return residual;
}

Matrix5d relative_pose_information(const Rigid3& b_from_a,
                                   const BearingMatches& matches,
                                   std::span<const std::uint32_t> indices) {
  Matrix5d information = Matrix5d::Zero();
  for (const std::uint32_t index : indices) {
    const Vector5d jacobian = epipolar_residual(b_from_a, matches, index).jacobian;
    information += jacobian * jacobian.transpose();
  }
  return information;
}

Rigid3 refine_relative_pose(const Rigid3& initial_b_from_a,
                            const BearingMatches& matches,
                            std::span<const std::uint32_t> indices,
                            const RefinementOptions& options) {
  Rigid3 pose = initial_b_from_a;
  for (double scale = options.first_scale; scale > options.last_scale; scale *= 0.5) {
    pose = descend(pose, matches, indices, scale * scale, options.max_iterations);
  }
  const double squared_scale = options.last_scale * options.last_scale;
  return descend(pose, matches, indices, squared_scale, options.max_iterations);
}

}  // namespace waymark

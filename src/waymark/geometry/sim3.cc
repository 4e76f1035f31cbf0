// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/sim3.h"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <span>

#include "waymark/geometry/rigid3.h"

namespace waymark {
namespace {

struct QuadratureNode {
  double position;  // in [-1, 1], taken with both signs
  double weight;
};

// Gauss-Legendre rules of ten and of four nodes (Abramowitz & Stegun 1964, table 25.4).
constexpr std::array<QuadratureNode, 5> kTenNodes = {{{0.1488743389816312, 0.2955242247147529},
                                                      {0.4333953941292472, 0.2692667193099963},
                                                      {0.6794095682990244, 0.2190863625159820},
                                                      {0.8650633666889845, 0.1494513491505806},
                                                      {0.9739065285171717, 0.0666713443086881}}};
constexpr std::array<QuadratureNode, 2> kFourNodes = {
    {{0.3399810435848563, 0.6521451548625461}, {0.8611363115940526, 0.3478548451374538}}};
// The error of four nodes, x^8 / 1.8e9 and 56 x^6 / 1.8e9 of the derivatives for angle and log of
// the scale x together, is below rounding up to here.
constexpr double kSmall = 0.05;

// The matrix that takes rho to the translation, W = integral over u in [0, 1] of
// exp(u sigma) exp(u skew(phi)) (Strasdat 2012; Eade). Its closed form has removable singularities
// at phi = 0 and sigma = 0, each with its own cancellation; the integrand is smooth, and the rule
// of ten nodes reaches 1e-15 for angles up to pi and scales from 1/20 to 20 without any case. Most
// residuals of a pose graph are small.
template <class Add>
void integrate(const Eigen::Vector3d& phi, double sigma, Add&& add) {
  const bool is_small = phi.norm() + std::abs(sigma) < kSmall;
  const std::span<const QuadratureNode> rule =
      is_small ? std::span<const QuadratureNode>(kFourNodes) : kTenNodes;
  for (const QuadratureNode& node : rule) {
    for (const double side : {-1.0, 1.0}) add(0.5 + 0.5 * side * node.position, 0.5 * node.weight);
  }
}

Eigen::Matrix3d translation_jacobian(const Eigen::Vector3d& phi, double sigma) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  integrate(phi, sigma, [&](double u, double weight) {
    sum += weight * std::exp(u * sigma) * so3_exp(u * phi).toRotationMatrix();
  });
  return sum;
}

}  // namespace

Sim3 Sim3::exp(const Vector7d& tangent) {
  const Eigen::Vector3d rho = tangent.head<3>();
  const Eigen::Vector3d phi = tangent.segment<3>(3);
  const double sigma = tangent[6];
  return {so3_exp(phi), translation_jacobian(phi, sigma) * rho, std::exp(sigma)};
}

Vector7d Sim3::log() const {
  const Eigen::Vector3d phi = so3_log(rotation);
  const double sigma = std::log(scale);
  Vector7d tangent;
  tangent << translation_jacobian(phi, sigma).inverse() * translation, phi, sigma;
  return tangent;
}

Matrix7d Sim3::adjoint() const {
  const Eigen::Matrix3d matrix = rotation.toRotationMatrix();
  Matrix7d result = Matrix7d::Zero();
  result.topLeftCorner<3, 3>() = scale * matrix;
  result.block<3, 3>(0, 3) = skew(translation) * matrix;
  result.topRightCorner<3, 1>() = -translation;
  result.block<3, 3>(3, 3) = matrix;
  result(6, 6) = 1.0;
  return result;
}

Matrix7d sim3_left_jacobian_inverse(const Vector7d& tangent) {
  const Eigen::Vector3d rho = tangent.head<3>();
  const Eigen::Vector3d phi = tangent.segment<3>(3);
  // W, and the derivatives of W rho by phi and sigma under the integral.
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d by_phi = Eigen::Matrix3d::Zero();
  Eigen::Vector3d by_sigma = Eigen::Vector3d::Zero();
  integrate(phi, tangent[6], [&](double u, double weight) {
    const Eigen::Matrix3d part =
        weight * std::exp(u * tangent[6]) * so3_exp(u * phi).toRotationMatrix();
    const Eigen::Vector3d moved = u * (part * rho);
    sum += part;
    by_phi -= skew(moved) * so3_left_jacobian(u * phi);
    by_sigma += moved;
  });
  // From t = W(phi, sigma) rho, which exp(d) moves by d_rho + d_phi x t + d_sigma t.
  const Eigen::Vector3d translation = sum * rho;
  const Eigen::Matrix3d rho_from_translation = sum.inverse();
  const Eigen::Matrix3d rotation_part = so3_left_jacobian_inverse(phi);
  Matrix7d result = Matrix7d::Zero();
  result.topLeftCorner<3, 3>() = rho_from_translation;
  result.block<3, 3>(0, 3) = -rho_from_translation * (skew(translation) + by_phi * rotation_part);
  result.topRightCorner<3, 1>() = rho_from_translation * (translation - by_sigma);
  result.block<3, 3>(3, 3) = rotation_part;
  result(6, 6) = 1.0;
  return result;
}

}  // namespace waymark

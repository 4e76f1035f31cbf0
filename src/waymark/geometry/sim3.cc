// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/sim3.h"

#include <Eigen/LU>
#include <array>
#include <cmath>

#include "waymark/geometry/so3.h"

namespace waymark {
namespace {

struct QuadratureNode {
  double position;  // in [-1, 1], taken with both signs
  double weight;
};

// Gauss-Legendre rule of ten nodes (Abramowitz & Stegun 1964, table 25.4).
constexpr std::array<QuadratureNode, 5> kGaussLegendre = {
    {{0.1488743389816312, 0.2955242247147529},
     {0.4333953941292472, 0.2692667193099963},
     {0.6794095682990244, 0.2190863625159820},
     {0.8650633666889845, 0.1494513491505806},
     {0.9739065285171717, 0.0666713443086881}}};

// The matrix that takes rho to the translation, W = integral over u in [0, 1] of
// exp(u sigma) exp(u skew(phi)) (Strasdat 2012; Eade). Its closed form has removable singularities
// at phi = 0 and sigma = 0, each with its own cancellation; the integrand is smooth, and the rule
// above reaches 1e-15 for angles up to pi and scales from 1/20 to 20 without any case.
Eigen::Matrix3d translation_jacobian(const Eigen::Vector3d& phi, double sigma) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const QuadratureNode& node : kGaussLegendre) {
    for (const double side : {-1.0, 1.0}) {
      const double u = 0.5 + 0.5 * side * node.position;
      sum += 0.5 * node.weight * std::exp(u * sigma) * so3_exp(u * phi).toRotationMatrix();
    }
  }
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

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "waymark/geometry/damping.h"

namespace waymark {

/// Of a robust sum of squares; hessian * step = -gradient. All without the factor 2 of the
/// derivative of a square.
template <int kSize>
struct NormalEquations {
  Eigen::Matrix<double, kSize, kSize> hessian = Eigen::Matrix<double, kSize, kSize>::Zero();
  Eigen::Matrix<double, kSize, 1> gradient = Eigen::Matrix<double, kSize, 1>::Zero();
  double cost = 0.0;
};

/// Prior information that keeps steps and covariances finite where nothing is measured.
inline constexpr double kPriorInformation = 1e-6;

/// Minimizes over a Rigid3 or Sim3 by steps exp(xi) * pose until one would lower the cost by less
/// than negligible. Adds to num_iterations, and returns the equations at the pose reached.
/// \param linearize  gives the NormalEquations at a pose.
template <class Pose, class Linearize>
auto minimize_over_pose(Pose& pose,
                        const Linearize& linearize,
                        int max_iterations,
                        double negligible,
                        int& num_iterations) {
  auto equations = linearize(pose);
  Damping damping(1e-6);
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    using Tangent = decltype(equations.gradient);
    const Tangent scale = equations.hessian.diagonal().array() + kPriorInformation;
    auto damped = equations.hessian;
    damped.diagonal() += damping.value() * scale;
    damped.diagonal().array() += kPriorInformation;
    const Tangent step = -damped.ldlt().solve(equations.gradient);
    const double decrease =
        step.dot(damping.value() * scale.cwiseProduct(step) - equations.gradient);
    if (!(decrease > negligible) || !step.allFinite()) break;
    ++num_iterations;
    const Pose candidate = Pose::exp(step) * pose;
    const auto next = linearize(candidate);
    const double gain = (equations.cost - next.cost) / decrease;
    if (gain > 0.0) {
      pose = candidate;
      equations = next;
      damping.accept(gain);
    } else {
      damping.reject();
    }
  }
  return equations;
}

/// Inverse of the information; a weak prior keeps it finite where there is none.
template <int kSize>
Eigen::Matrix<double, kSize, kSize> covariance_from(
    Eigen::Matrix<double, kSize, kSize> information) {
  const double floor = 1e-12 * information.diagonal().maxCoeff();
  information.diagonal().array() += std::max(kPriorInformation, floor);
  const Eigen::Matrix<double, kSize, kSize> inverse =
      information.ldlt().solve(Eigen::Matrix<double, kSize, kSize>::Identity());
  return 0.5 * (inverse + inverse.transpose());
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace waymark {

/// Damping of Levenberg-Marquardt (Madsen, Nielsen & Tingleff 2004, 3.2), to be scaled by the
/// diagonal of the Hessian (Marquardt 1963).
class Damping {
 public:
  explicit Damping(double initial, double least = 0.0) : value_(initial), least_(least) {}

  double value() const { return value_; }

  /// After a step that lowered the cost by `gain` times as much as the linear model promised.
  void accept(double gain) {
    value_ *= std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * gain - 1.0, 3));
    value_ = std::max(value_, least_);
    growth_ = 2.0;
  }

  void reject() {
    value_ *= growth_;
    growth_ *= 2.0;
  }

 private:
  double value_;
  double growth_ = 2.0;
  double least_;
};

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

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/preintegration.h"

#include <Eigen/Cholesky>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/geometry/rigid3.h"

namespace waymark {
namespace {

/// The turn in rad, by a changed gyroscope bias, from which on its second order counts: half the
/// square of it tilts gravity by 0.1 mm/s^2, a tenth of what the noise does in a second.
constexpr double kFarTurn = 0.005;
/// The velocity in m/s, by a changed accelerometer bias, that is far. The delta is linear in it,
/// but for the product with kFarTurn.
constexpr double kFarVelocity = 0.1;

double seconds(std::int64_t nanoseconds) { return 1e-9 * static_cast<double>(nanoseconds); }

}  // namespace

/// One step from a sample to the next: error_2 = by_error * error_1 - by_rates * (errors of rates).
struct Preintegration::Step {
  double dt = 0.0;
  Matrix9d by_error = Matrix9d::Identity();
  Eigen::Matrix<double, 9, 6> by_rates = Eigen::Matrix<double, 9, 6>::Zero();
};

Preintegration::Preintegration(std::vector<ImuSample> samples,
                               const ImuNoise& noise,
                               const ImuBiases& biases)
    : samples_(std::move(samples)), noise_(noise), biases_(biases) {
  WAYMARK_CHECK(samples_.size() >= 2);
  WAYMARK_CHECK(noise.gyroscope > 0.0 && noise.accelerometer > 0.0);
  WAYMARK_CHECK(noise.gyroscope_walk > 0.0 && noise.accelerometer_walk > 0.0);
  integrate();
}

double Preintegration::duration_s() const {
  return seconds(samples_.back().timestamp_ns - samples_.front().timestamp_ns);
}

void Preintegration::integrate() {
  delta_ = {};
  by_biases_.setZero();
  by_scales_.setZero();
  covariance_.setZero();
  for (std::size_t i = 1; i < samples_.size(); ++i) advance(samples_[i - 1], samples_[i]);
  delta_.rotation.normalize();
  const Eigen::LLT<Matrix15d> factor(covariance_);
  WAYMARK_CHECK(factor.info() == Eigen::Success);
  square_root_information_ = factor.matrixL().solve(Matrix15d::Identity());
}

/// The trapezoidal rule in the frame of the first moment: constant angular velocity, the mean of
/// both ends, and acceleration that is linear between them. Exact to second order in the step.
void Preintegration::advance(const ImuSample& begin, const ImuSample& end) {
  Step step;
  const double dt = seconds(end.timestamp_ns - begin.timestamp_ns);
  WAYMARK_CHECK(dt > 0.0);
  step.dt = dt;
  const Eigen::Vector3d turn =
      dt * (0.5 * (begin.angular_velocity + end.angular_velocity) - biases_.gyroscope);
  const Eigen::Quaterniond rotation = so3_exp(turn);
  const Eigen::Matrix3d before = delta_.rotation.toRotationMatrix();
  const Eigen::Matrix3d after = before * rotation.toRotationMatrix();
  const Eigen::Vector3d force_before = begin.acceleration - biases_.accelerometer;
  const Eigen::Vector3d force_after = end.acceleration - biases_.accelerometer;
  const Eigen::Vector3d a_before = before * force_before;
  const Eigen::Vector3d a_after = after * force_after;
  delta_.position += dt * delta_.velocity + dt * dt / 6.0 * (2.0 * a_before + a_after);
  delta_.velocity += 0.5 * dt * (a_before + a_after);
  delta_.rotation = delta_.rotation * rotation;

  const Eigen::Matrix3d turn_by_error = rotation.toRotationMatrix().transpose();
  const Eigen::Matrix3d turn_by_rate = dt * so3_left_jacobian(-turn);
  const Eigen::Matrix3d before_by_error = -before * skew(force_before);
  const Eigen::Matrix3d after_by_turn = -after * skew(force_after);
  const Eigen::Matrix3d after_by_error = after_by_turn * turn_by_error;
  const Eigen::Matrix3d after_by_rate = after_by_turn * turn_by_rate;
  step.by_error.block<3, 3>(0, 0) = turn_by_error;
  step.by_error.block<3, 3>(3, 0) = 0.5 * dt * (before_by_error + after_by_error);
  step.by_error.block<3, 3>(6, 0) = dt * dt / 6.0 * (2.0 * before_by_error + after_by_error);
  step.by_error.block<3, 3>(6, 3) = dt * Eigen::Matrix3d::Identity();
  step.by_rates.block<3, 3>(0, 0) = turn_by_rate;
  step.by_rates.block<3, 3>(3, 0) = 0.5 * dt * after_by_rate;
  step.by_rates.block<3, 3>(3, 3) = 0.5 * dt * (before + after);
  step.by_rates.block<3, 3>(6, 0) = dt * dt / 6.0 * after_by_rate;
  step.by_rates.block<3, 3>(6, 3) = dt * dt / 6.0 * (2.0 * before + after);
  by_biases_ = step.by_error * by_biases_ - step.by_rates;
  Eigen::Matrix<double, 6, 1> rates;
  rates << turn / dt, 0.5 * (force_before + force_after);
  by_scales_ = step.by_error * by_scales_ - step.by_rates * rates.asDiagonal();
  advance_covariance(step);
}

/// Noise of continuous time has the variance density^2 / dt in a step (Forster et al. 2017, eq.
/// 62), and moves the position within the step by dt^3 / 12 more than the mean of it. The walk of
/// the biases enters all that follows.
void Preintegration::advance_covariance(const Step& step) {
  const Eigen::Matrix<double, 6, 6> walked = covariance_.bottomRightCorner<6, 6>();
  const Eigen::Matrix<double, 9, 6> across = covariance_.topRightCorner<9, 6>();
  Eigen::Matrix<double, 6, 6> rates = walked;
  const auto square = [](double value) { return value * value; };
  rates.diagonal().head<3>().array() += square(noise_.gyroscope) / step.dt;
  rates.diagonal().tail<3>().array() += square(noise_.accelerometer) / step.dt;
  const Matrix9d mixed = step.by_error * across * step.by_rates.transpose();
  covariance_.topLeftCorner<9, 9>() =
      step.by_error * covariance_.topLeftCorner<9, 9>() * step.by_error.transpose() - mixed -
      mixed.transpose() + step.by_rates * rates * step.by_rates.transpose();
  covariance_.diagonal().segment<3>(6).array() +=
      square(noise_.accelerometer) * step.dt * step.dt * step.dt / 12.0;
  covariance_.topRightCorner<9, 6>() = step.by_error * across - step.by_rates * walked;
  covariance_.bottomLeftCorner<6, 9>() = covariance_.topRightCorner<9, 6>().transpose();
  covariance_.diagonal().segment<3>(9).array() += step.dt * square(noise_.gyroscope_walk);
  covariance_.diagonal().segment<3>(12).array() += step.dt * square(noise_.accelerometer_walk);
}

InertialDelta Preintegration::delta_with(const ImuBiases& biases) const {
  Eigen::Matrix<double, 6, 1> change;
  change << biases.gyroscope - biases_.gyroscope, biases.accelerometer - biases_.accelerometer;
  const Eigen::Matrix<double, 9, 1> correction = by_biases_ * change;
  return {delta_.rotation * so3_exp(correction.head<3>()),
          delta_.velocity + correction.segment<3>(3),
          delta_.position + correction.tail<3>()};
}

bool Preintegration::reintegrate_if_far(const ImuBiases& biases) {
  const double duration = duration_s();
  const double turn = duration * (biases.gyroscope - biases_.gyroscope).norm();
  const double velocity = duration * (biases.accelerometer - biases_.accelerometer).norm();
  if (turn <= kFarTurn && velocity <= kFarVelocity) return false;
  biases_ = biases;
  integrate();
  return true;
}

}  // namespace waymark

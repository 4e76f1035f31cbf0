// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/rigid3.h"

#include <cmath>

namespace waymark {
namespace {

// Below this squared angle the closed forms lose digits to cancellation and the first terms of
// their Taylor series are exact to double precision.
constexpr double kSmallSquaredAngle = 1e-4;

}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& a) {
  Eigen::Matrix3d result;
  result << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return result;
}

Eigen::Quaterniond so3_exp(const Eigen::Vector3d& rotation_vector) {
  const double squared_angle = rotation_vector.squaredNorm();
  double w = 0.0;
  double half_sinc = 0.0;  // sin(angle / 2) / angle
  if (squared_angle < kSmallSquaredAngle) {
    w = 1.0 - squared_angle / 8.0 * (1.0 - squared_angle / 48.0);
    half_sinc = 0.5 - squared_angle / 48.0 * (1.0 - squared_angle / 80.0);
  } else {
    const double angle = std::sqrt(squared_angle);
    w = std::cos(0.5 * angle);
    half_sinc = std::sin(0.5 * angle) / angle;
  }
  const Eigen::Vector3d v = half_sinc * rotation_vector;
  return Eigen::Quaterniond(w, v.x(), v.y(), v.z()).normalized();
}

Eigen::Vector3d so3_log(const Eigen::Quaterniond& rotation) {
  // q and -q are the same rotation; the one with w >= 0 gives the angle in [0, pi].
  const double sign = rotation.w() < 0.0 ? -1.0 : 1.0;
  const double w = sign * rotation.w();
  const Eigen::Vector3d v = sign * rotation.vec();
  const double squared_sine = v.squaredNorm();
  if (squared_sine < kSmallSquaredAngle) {
    const double ratio = squared_sine / (w * w);
    return 2.0 / w * (1.0 - ratio / 3.0 * (1.0 - ratio * (3.0 / 5.0 - ratio * 3.0 / 7.0))) * v;
  }
  const double sine = std::sqrt(squared_sine);
  return 2.0 * std::atan2(sine, w) / sine * v;
}

Eigen::Matrix3d so3_left_jacobian(const Eigen::Vector3d& rotation_vector) {
  const double squared_angle = rotation_vector.squaredNorm();
  double first = 0.0;   // (1 - cos) / angle^2
  double second = 0.0;  // (angle - sin) / angle^3
  if (squared_angle < kSmallSquaredAngle) {
    first = 0.5 - squared_angle / 24.0 * (1.0 - squared_angle / 30.0);
    second = 1.0 / 6.0 - squared_angle / 120.0 * (1.0 - squared_angle / 42.0);
  } else {
    const double angle = std::sqrt(squared_angle);
    first = (1.0 - std::cos(angle)) / squared_angle;
    second = (angle - std::sin(angle)) / (squared_angle * angle);
  }
  const Eigen::Matrix3d hat = skew(rotation_vector);
  return Eigen::Matrix3d::Identity() + first * hat + second * hat * hat;
}

Eigen::Matrix3d so3_left_jacobian_inverse(const Eigen::Vector3d& rotation_vector) {
  const double squared_angle = rotation_vector.squaredNorm();
  double second = 0.0;  // (1 - angle / 2 * cot(angle / 2)) / angle^2
  if (squared_angle < kSmallSquaredAngle) {
    second = 1.0 / 12.0 + squared_angle / 720.0 * (1.0 + squared_angle / 42.0);
  } else {
    const double half_angle = 0.5 * std::sqrt(squared_angle);
    second = (1.0 - half_angle * std::cos(half_angle) / std::sin(half_angle)) / squared_angle;
  }
  const Eigen::Matrix3d hat = skew(rotation_vector);
  return Eigen::Matrix3d::Identity() - 0.5 * hat + second * hat * hat;
}

Eigen::Matrix4d Rigid3::matrix() const {
  Eigen::Matrix4d result = Eigen::Matrix4d::Identity();
  result.topLeftCorner<3, 3>() = rotation_matrix();
  result.topRightCorner<3, 1>() = translation;
  return result;
}

Rigid3 Rigid3::exp(const Vector6d& tangent) {
  const Eigen::Vector3d rho = tangent.head<3>();
  const Eigen::Vector3d phi = tangent.tail<3>();
  return {so3_exp(phi), so3_left_jacobian(phi) * rho};  // Sola et al. 2018, eq. 172
}

Vector6d Rigid3::log() const {
  const Eigen::Vector3d phi = so3_log(rotation);
  Vector6d tangent;
  tangent << so3_left_jacobian_inverse(phi) * translation, phi;  // Sola et al. 2018, eq. 173
  return tangent;
}

Matrix6d Rigid3::adjoint() const {
  const Eigen::Matrix3d matrix = rotation_matrix();
  Matrix6d result = Matrix6d::Zero();  // Sola et al. 2018, eq. 175
  result.topLeftCorner<3, 3>() = matrix;
  result.topRightCorner<3, 3>() = skew(translation) * matrix;
  result.bottomRightCorner<3, 3>() = matrix;
  return result;
}

}  // namespace waymark

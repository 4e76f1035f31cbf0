// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/inertial_residual.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/geometry/bearing.h"

namespace waymark {
namespace {

using Matrix3x15d = Eigen::Matrix<double, 3, 15>;
using Matrix3x10d = Eigen::Matrix<double, 3, 10>;

/// Where the IMU was when its samples begin or end, with derivatives by state and setup. Turns are
/// on the right of the rotation.
struct ImuEnd {
  Eigen::Matrix3d rotation;  ///< world_from_imu.
  Eigen::Vector3d position;  ///< In metres, in the world.
  Matrix3x15d turn_by_state = Matrix3x15d::Zero();
  Matrix3x10d turn_by_setup = Matrix3x10d::Zero();
  Matrix3x15d position_by_state = Matrix3x15d::Zero();
  Matrix3x10d position_by_setup = Matrix3x10d::Zero();
};

ImuEnd imu_end(const InertialState& state, const InertialSetup& setup, const ImuSample& sample) {
  ImuEnd end;
  const double scale = std::exp(setup.log_scale);
  const double shift = setup.time_shift_change_s;
  const Eigen::Matrix3d world_from_rig = state.rig_from_world.rotation_matrix().transpose();
  const Eigen::Matrix3d imu_from_rig = setup.imu_from_rig.rotation_matrix();
  const Eigen::Vector3d lever_arm = setup.imu_from_rig.origin_in_source();
  const Eigen::Vector3d centre = state.rig_from_world.origin_in_source();
  const Eigen::Matrix3d at_image = world_from_rig * imu_from_rig.transpose();
  const Eigen::Vector3d rate = sample.angular_velocity - state.biases.gyroscope;
  const Eigen::Matrix3d forth = so3_exp(shift * rate).toRotationMatrix();
  end.rotation = at_image * forth.transpose();
  end.position = scale * centre + world_from_rig * lever_arm - shift * state.velocity;

  end.turn_by_state.block<3, 3>(0, 3) = -forth * imu_from_rig;
  end.turn_by_state.block<3, 3>(0, 9) = shift * so3_left_jacobian(shift * rate);
  end.turn_by_setup.block<3, 3>(0, 6) = -forth;
  end.turn_by_setup.col(9) = -rate;
  end.position_by_state.block<3, 3>(0, 0) = -scale * world_from_rig;
  end.position_by_state.block<3, 3>(0, 3) = world_from_rig * skew(lever_arm);
  end.position_by_state.block<3, 3>(0, 6) = -shift * Eigen::Matrix3d::Identity();
  end.position_by_setup.col(2) = scale * centre;
  end.position_by_setup.block<3, 3>(0, 3) = -at_image;
  end.position_by_setup.col(9) = -state.velocity;
  return end;
}

/// Rows of the rotation: log(delta^T R_1^T R_2).
void add_rotation(const Preintegration& preintegration,
                  const InertialState& first,
                  const ImuEnd& begin,
                  const ImuEnd& end,
                  InertialResidual& residual) {
  const InertialDelta delta = preintegration.delta_with(first.biases);
  const Eigen::Matrix3d between = begin.rotation.transpose() * end.rotation;
  const Eigen::Vector3d value =
      so3_log(delta.rotation.conjugate() * Eigen::Quaterniond(between).normalized());
  const Eigen::Matrix3d by_end = so3_left_jacobian_inverse(-value);
  const Eigen::Matrix3d by_begin = -by_end * between.transpose();
  const Eigen::Matrix3d delta_by_bias = preintegration.by_biases().topLeftCorner<3, 3>();
  const Eigen::Vector3d correction =
      delta_by_bias * (first.biases.gyroscope - preintegration.biases().gyroscope);
  residual.value.head<3>() = value;
  residual.by_first.topRows<3>() = by_begin * begin.turn_by_state;
  residual.by_first.block<3, 3>(0, 9) -=
      so3_left_jacobian_inverse(value) * so3_left_jacobian(-correction) * delta_by_bias;
  residual.by_second.topRows<3>() = by_end * end.turn_by_state;
  residual.by_setup.topRows<3>() = by_begin * begin.turn_by_setup + by_end * end.turn_by_setup;
}

/// Rows of velocity and position: R_1^T (what remains without gravity and first velocity) - delta.
void add_translation(const Preintegration& preintegration,
                     const InertialState& first,
                     const InertialState& second,
                     const InertialSetup& setup,
                     const ImuEnd& begin,
                     const ImuEnd& end,
                     InertialResidual& residual) {
  const double t = preintegration.duration_s();
  const InertialDelta delta = preintegration.delta_with(first.biases);
  const Eigen::Matrix3d imu_from_world = begin.rotation.transpose();
  const Eigen::Vector3d velocity =
      imu_from_world * (second.velocity - first.velocity - t * setup.gravity);
  const Eigen::Vector3d position =
      imu_from_world *
      (end.position - begin.position - t * first.velocity - 0.5 * t * t * setup.gravity);
  const Eigen::Matrix<double, 3, 2> by_gravity =
      -imu_from_world * skew(setup.gravity) * tangent_basis(setup.gravity.normalized());

  residual.value.segment<3>(3) = velocity - delta.velocity;
  residual.by_first.middleRows<3>(3) = skew(velocity) * begin.turn_by_state;
  residual.by_first.block<3, 3>(3, 6) -= imu_from_world;
  residual.by_second.block<3, 3>(3, 6) = imu_from_world;
  residual.by_setup.middleRows<3>(3) = skew(velocity) * begin.turn_by_setup;
  residual.by_setup.block<3, 2>(3, 0) -= t * by_gravity;

  residual.value.segment<3>(6) = position - delta.position;
  residual.by_first.middleRows<3>(6) =
      skew(position) * begin.turn_by_state - imu_from_world * begin.position_by_state;
  residual.by_first.block<3, 3>(6, 6) -= t * imu_from_world;
  residual.by_second.middleRows<3>(6) = imu_from_world * end.position_by_state;
  residual.by_setup.middleRows<3>(6) =
      skew(position) * begin.turn_by_setup +
      imu_from_world * (end.position_by_setup - begin.position_by_setup);
  residual.by_setup.block<3, 2>(6, 0) -= 0.5 * t * t * by_gravity;
  residual.by_first.block<6, 6>(3, 9) -= preintegration.by_biases().bottomRows<6>();
}

/// Where a delta leads from a state (Forster et al. 2017, eq. 33, solved for the second state).
InertialState state_after(const InertialState& first,
                          const Preintegration& preintegration,
                          const InertialSetup& setup) {
  const double t = preintegration.duration_s();
  const InertialDelta delta = preintegration.delta_with(first.biases);
  const Rigid3 begin = world_from_imu(first, setup);
  const Rigid3 end((begin.rotation * delta.rotation).normalized(),
                   begin.translation + t * first.velocity + 0.5 * t * t * setup.gravity +
                       begin.rotation * delta.position);
  InertialState second = first;
  second.velocity += t * setup.gravity + begin.rotation * delta.velocity;
  second.rig_from_world = (end * setup.imu_from_rig).inverse();
  second.rig_from_world.translation *= std::exp(-setup.log_scale);
  return second;
}

}  // namespace

InertialState InertialState::moved(const Vector15d& tangent) const {
  return {Rigid3::exp(tangent.head<6>()) * rig_from_world,
          velocity + tangent.segment<3>(6),
          {biases.gyroscope + tangent.segment<3>(9), biases.accelerometer + tangent.tail<3>()}};
}

InertialSetup InertialSetup::moved(const Vector10d& tangent) const {
  const Eigen::Vector3d turn = tangent_basis(gravity.normalized()) * tangent.head<2>();
  return {so3_exp(turn) * gravity,
          log_scale + tangent[2],
          Rigid3::exp(tangent.segment<6>(3)) * imu_from_rig,
          time_shift_change_s + tangent[9]};
}

Rigid3 world_from_imu(const InertialState& state, const InertialSetup& setup) {
  Rigid3 metric = state.rig_from_world;
  metric.translation *= std::exp(setup.log_scale);
  return (setup.imu_from_rig * metric).inverse();
}

InertialResidual inertial_residual(const Preintegration& preintegration,
                                   const InertialState& first,
                                   const InertialState& second,
                                   const InertialSetup& setup) {
  InertialResidual residual;
  residual.by_first.setZero();
  residual.by_second.setZero();
  residual.by_setup.setZero();
  const ImuEnd begin = imu_end(first, setup, preintegration.first_sample());
  const ImuEnd end = imu_end(second, setup, preintegration.last_sample());
  add_rotation(preintegration, first, begin, end, residual);
  add_translation(preintegration, first, second, setup, begin, end, residual);
  residual.value.segment<3>(9) = second.biases.gyroscope - first.biases.gyroscope;
  residual.value.tail<3>() = second.biases.accelerometer - first.biases.accelerometer;
  residual.by_first.bottomRightCorner<6, 6>().diagonal().setConstant(-1.0);
  residual.by_second.bottomRightCorner<6, 6>().diagonal().setConstant(1.0);

  const Matrix15d& whiten = preintegration.square_root_information();
  residual.value = whiten * residual.value.eval();
  residual.by_first = whiten * residual.by_first.eval();
  residual.by_second = whiten * residual.by_second.eval();
  residual.by_setup = whiten * residual.by_setup.eval();
  return residual;
}

std::optional<InertialEstimate> predict(const InertialEstimate& first,
                                        const ImuSamples& samples,
                                        std::int64_t begin_ns,
                                        std::int64_t end_ns,
                                        const ImuNoise& noise,
                                        const InertialSetup& setup) {
  WAYMARK_CHECK(setup.time_shift_change_s == 0.0);
  std::vector<ImuSample> between = samples.between(begin_ns, end_ns);
  if (between.empty()) return std::nullopt;
  const Preintegration measured(std::move(between), noise, first.state.biases);
  InertialEstimate second;
  second.state = state_after(first.state, measured, setup);
  // The whitened residual n of both has unit covariance: by_setup * e_s + by_first * e_1 +
  // by_second * e_2 = n.
  const InertialResidual residual = inertial_residual(measured, first.state, second.state, setup);
  const Matrix15d inverse = residual.by_second.inverse();
  Matrix25d by_before = Matrix25d::Identity();
  by_before.bottomLeftCorner<15, 10>() = -inverse * residual.by_setup;
  by_before.bottomRightCorner<15, 15>() = -inverse * residual.by_first;
  second.covariance = by_before * first.covariance * by_before.transpose();
  second.covariance.bottomRightCorner<15, 15>() += inverse * inverse.transpose();
  return second;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "waymark/imu/imu.h"

namespace waymark {

/// Linear map, or covariance, of (rotation, velocity, position).
using Matrix9d = Eigen::Matrix<double, 9, 9>;
/// Linear map, or covariance, of (rotation, velocity, position, gyroscope bias, accelerometer
/// bias).
using Matrix15d = Eigen::Matrix<double, 15, 15>;

/// How the IMU moved from a first to a second moment, seen from the IMU at the first one that falls
/// freely (Forster, Carlone, Dellaert and Scaramuzza 2017, eq. 33).
struct InertialDelta {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< imu_1_from_imu_2.
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();            ///< m/s.
  Eigen::Vector3d position = Eigen::Vector3d::Zero();            ///< m.
};

/// The samples between two moments as one measurement that does not depend on where the IMU was and
/// how fast (Forster et al. 2017). Errors are (rotation, velocity, position) in this order, that of
/// the rotation on the right: delta.rotation * exp(error), in rad, m/s and m.
class Preintegration {
 public:
  /// samples: two or more of strictly ascending times, the first and last at the two moments, as
  /// ImuSamples::between gives them. All densities of the noise are positive.
  Preintegration(std::vector<ImuSample> samples, const ImuNoise& noise, const ImuBiases& biases);

  double duration_s() const;
  const ImuSample& first_sample() const { return samples_.front(); }
  const ImuSample& last_sample() const { return samples_.back(); }

  /// The biases that the samples were integrated with.
  const ImuBiases& biases() const { return biases_; }
  const InertialDelta& delta() const { return delta_; }
  /// With other biases, to first order (Forster et al. 2017, eq. 44).
  InertialDelta delta_with(const ImuBiases& biases) const;
  /// Integrates anew where other biases are so far off that the second order counts (by 5 mrad or
  /// 0.1 m/s at the end); returns whether it did.
  bool reintegrate_if_far(const ImuBiases& biases);

  /// 9x6: (rotation, velocity, position) by (gyroscope bias, accelerometer bias).
  const Eigen::Matrix<double, 9, 6>& by_biases() const { return by_biases_; }
  /// 9x6: the same by how much too large, as a part, each axis measures (gyroscope, accelerometer).
  const Eigen::Matrix<double, 9, 6>& by_scales() const { return by_scales_; }
  /// Of the errors from noise and from biases that move in between, and of how far both biases move
  /// (their random walks), which go together.
  const Matrix15d& covariance() const { return covariance_; }
  /// Lower triangular L with L^T L the inverse of covariance().
  const Matrix15d& square_root_information() const { return square_root_information_; }

 private:
  struct Step;
  void integrate();
  void advance(const ImuSample& begin, const ImuSample& end);
  void advance_covariance(const Step& step);

  std::vector<ImuSample> samples_;
  ImuNoise noise_;
  ImuBiases biases_;
  InertialDelta delta_;
  Eigen::Matrix<double, 9, 6> by_biases_, by_scales_;
  Matrix15d covariance_;
  Matrix15d square_root_information_;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/solver/calibration_border.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cstdlib>

namespace waymark {
namespace {

/// Two poses, two points, three parameters and random residual rows: the same equations by blocks
/// and as one dense matrix over poses, points and parameters.
class CalibrationBorderTest : public ::testing::Test {
 protected:
  static constexpr int kNumPoses = 2, kNumPoints = 2, kNumParameters = 3;
  static constexpr int kFirstPoint = 6 * kNumPoses, kFirstParameter = kFirstPoint + 3 * kNumPoints;
  static constexpr int kSize = kFirstParameter + kNumParameters;

  CalibrationBorderTest() {
    std::srand(7);
    calibration_.prior_information = Eigen::Matrix3d::Identity() * 2.0;
    calibration_.prior_change = Eigen::Vector3d(0.3, -0.1, 0.2);
    hessian_.setIdentity(kSize, kSize);
    hessian_ *= 0.5;
    hessian_.bottomRightCorner<3, 3>() = calibration_.prior_information;
    gradient_.setZero(kSize);
    gradient_.tail<3>() = -calibration_.prior_information * calibration_.prior_change;
  }

  Eigen::MatrixXd hessian_;
  Eigen::VectorXd gradient_;
  BundleCalibration calibration_;
};

TEST_F(CalibrationBorderTest, SolvesAsTheDenseEquationsDo) {
  CalibrationBorder border(kNumParameters, kNumPoses, kNumPoints);
  border.begin(calibration_, Eigen::Vector3d::Zero());
  for (int pose = 0; pose < kNumPoses; ++pose) {
    for (int point = 0; point < kNumPoints; ++point) {
      for (int k = 0; k < 4; ++k) {
        const Eigen::Matrix<double, 2, 6> by_pose = Eigen::Matrix<double, 2, 6>::Random();
        const Matrix23d by_point = Matrix23d::Random();
        const ByCalibration by_calibration = Eigen::Matrix<double, 3, 2>::Random();
        const Eigen::Vector2d residual = Eigen::Vector2d::Random();
        Eigen::MatrixXd row = Eigen::MatrixXd::Zero(2, kSize);
        row.middleCols<6>(6 * pose) = by_pose;
        row.middleCols<3>(kFirstPoint + 3 * point) = by_point;
        row.rightCols<3>() = by_calibration.transpose();
        hessian_ += row.transpose() * row;
        gradient_ += row.transpose() * residual;
        border.add(0, by_calibration, residual, static_cast<std::size_t>(point), by_point);
        border.add_pose(0, by_calibration, static_cast<std::size_t>(pose), by_pose);
      }
    }
  }
  BlockCholesky reduced(kNumPoses, {{1, 0}});
  reduced.set_zero();
  reduced.diagonal(0) = hessian_.block<6, 6>(0, 0);
  reduced.diagonal(1) = hessian_.block<6, 6>(6, 6);
  Eigen::VectorXd poses = gradient_.head<12>();
  border.begin_elimination(0.0);
  for (int point = 0; point < kNumPoints; ++point) {
    const int at = kFirstPoint + 3 * point;
    const Eigen::Matrix3d inverse = hessian_.block<3, 3>(at, at).inverse();
    const Eigen::Matrix3d half = inverse.llt().matrixU();  // half^T * half is the inverse.
    const Eigen::Vector3d pull = half * gradient_.segment<3>(at);
    border.eliminate_point(static_cast<std::size_t>(point), half, pull);
    Eigen::Matrix<double, 6, 3> eliminated[2];
    for (int pose = 0; pose < kNumPoses; ++pose) {
      eliminated[pose] = hessian_.block<6, 3>(6 * pose, at) * half.transpose();
      border.eliminate_link(
          static_cast<std::size_t>(pose), static_cast<std::size_t>(point), eliminated[pose]);
      poses.segment<6>(6 * pose) -= eliminated[pose] * pull;
      reduced.diagonal(static_cast<std::uint32_t>(pose)) -=
          eliminated[pose] * eliminated[pose].transpose();
    }
    reduced.block(1, 0) -= eliminated[1] * eliminated[0].transpose();
  }
  ThreadPool one_thread(1);
  ASSERT_TRUE(reduced.factorize(one_thread));
  ASSERT_TRUE(border.solve(reduced, poses));
  const Eigen::VectorXd expected = hessian_.ldlt().solve(gradient_);
  EXPECT_LT((poses - expected.head<12>()).norm(), 1e-9);
  EXPECT_LT((border.solution() - expected.tail<3>()).norm(), 1e-9);
}

TEST_F(CalibrationBorderTest, AddsUpWhatPartsOfTheWayTell) {
  constexpr std::size_t kNumFrames = 40;
  CalibrationBorder border(kNumParameters, kNumPoses, kNumPoints);
  border.begin(calibration_, Eigen::Vector3d::Zero());
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  for (std::size_t frame = 0; frame < kNumFrames; ++frame) {
    const Eigen::MatrixXd by_calibration = Eigen::MatrixXd::Random(3, 2);
    const Eigen::Vector2d residual = Eigen::Vector2d::Random();
    border.add_told(frame, kNumFrames, by_calibration, residual);
    information += by_calibration * by_calibration.transpose();
    gradient += by_calibration * residual;
  }
  const CalibrationEvidence evidence = border.evidence();
  EXPECT_LT((evidence.whole.information - information).norm(), 1e-9);
  EXPECT_LT((evidence.whole.gradient - gradient).norm(), 1e-9);
  ASSERT_EQ(evidence.parts.size(), 10u);
  // What a step is too long for, parts contradict each other in.
  const Eigen::VectorXd step = -information.ldlt().solve(gradient);
  const Eigen::MatrixXd left = evidence.scatter_after(step);
  EXPECT_GT(left.trace(), 0.0);
  EXPECT_GT(evidence.scatter_after(100.0 * step).trace(), left.trace());
}

}  // namespace
}  // namespace waymark

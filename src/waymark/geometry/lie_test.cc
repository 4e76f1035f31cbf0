// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <unsupported/Eigen/MatrixFunctions>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/geometry/sim3.h"
#include "waymark/geometry/testing/scenes.h"

namespace waymark {
namespace {

using testing::random_vector;

// Angles on both sides of every change of formula, up to almost pi.
std::vector<double> angles() {
  return {
      0.0, 1e-12, 1e-8, 1e-5, 0.009999, 0.010001, 0.02, 0.0499, 0.3, 1.0, 2.0, 3.1, M_PI - 1e-6};
}

TEST(So3, SkewIsTheCrossProduct) {
  Rng rng(1, 0);
  const Eigen::Vector3d a = random_vector(rng), b = random_vector(rng);
  EXPECT_TRUE((skew(a) * b).isApprox(a.cross(b)));
}

TEST(So3, ExpIsTheMatrixExponential) {
  Rng rng(2, 0);
  for (const double angle : angles()) {
    const Eigen::Vector3d phi = angle * random_vector(rng).normalized();
    const Eigen::Matrix3d oracle = skew(phi).exp();
    EXPECT_LT((so3_exp(phi).toRotationMatrix() - oracle).norm(), 1e-14) << angle;
  }
}

TEST(So3, LogInvertsExpForBothSignsOfTheQuaternion) {
  Rng rng(3, 0);
  for (const double angle : angles()) {
    const Eigen::Vector3d phi = angle * random_vector(rng).normalized();
    const Eigen::Quaterniond q = so3_exp(phi);
    EXPECT_LT((so3_log(q) - phi).norm(), 1e-14 * (1.0 + angle)) << angle;
    EXPECT_LT((so3_log(Eigen::Quaterniond(-q.coeffs())) - phi).norm(), 1e-14 * (1.0 + angle));
  }
}

TEST(So3, LogOfHalfATurnHasAngleOfPi) {
  EXPECT_NEAR(so3_log(Eigen::Quaterniond(0.0, 0.6, 0.0, 0.8)).norm(), M_PI, 1e-15);
}

TEST(So3, LeftJacobianMatchesNumericDerivative) {
  Rng rng(4, 0);
  for (const double angle : angles()) {
    const Eigen::Vector3d phi = angle * random_vector(rng).normalized();
    Eigen::Matrix3d numeric;
    const double step = 1e-6;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d delta = step * Eigen::Vector3d::Unit(i);
      numeric.col(i) =
          so3_log(so3_exp(phi + delta) * so3_exp(phi - delta).conjugate()) / (2 * step);
    }
    EXPECT_LT((so3_left_jacobian(phi) - numeric).norm(), 1e-8) << angle;
    EXPECT_LT(
        (so3_left_jacobian(phi) * so3_left_jacobian_inverse(phi) - Eigen::Matrix3d::Identity())
            .norm(),
        1e-13)
        << angle;
  }
}

TEST(Rigid3, ExpIsTheMatrixExponentialAndLogInvertsIt) {
  Rng rng(5, 0);
  for (const double angle : angles()) {
    Vector6d xi;
    xi << random_vector(rng), angle * random_vector(rng).normalized();
    Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
    generator.topLeftCorner<3, 3>() = skew(xi.tail<3>());
    generator.topRightCorner<3, 1>() = xi.head<3>();
    const Rigid3 rigid = Rigid3::exp(xi);
    EXPECT_LT((rigid.matrix() - generator.exp()).norm(), 1e-13) << angle;
    EXPECT_LT((rigid.log() - xi).norm(), 1e-12) << angle;
  }
}

TEST(Rigid3, ComposesAndInverts) {
  Rng rng(6, 0);
  Vector6d xi_ba, xi_cb;
  xi_ba << random_vector(rng), random_vector(rng);
  xi_cb << random_vector(rng), random_vector(rng);
  const Rigid3 b_from_a = Rigid3::exp(xi_ba), c_from_b = Rigid3::exp(xi_cb);
  const Eigen::Vector3d point_in_a = random_vector(rng);
  EXPECT_TRUE(((c_from_b * b_from_a) * point_in_a).isApprox(c_from_b * (b_from_a * point_in_a)));
  EXPECT_TRUE((b_from_a.inverse() * (b_from_a * point_in_a)).isApprox(point_in_a));
  EXPECT_LT((b_from_a * b_from_a.origin_in_source()).norm(), 1e-14);
}

TEST(Rigid3, AdjointMovesAPerturbationToTheOtherSide) {
  Rng rng(7, 0);
  Vector6d xi_ba, xi_a;
  xi_ba << random_vector(rng), random_vector(rng);
  xi_a << random_vector(rng), random_vector(rng);
  const Rigid3 b_from_a = Rigid3::exp(xi_ba);
  const Rigid3 left = Rigid3::exp(b_from_a.adjoint() * xi_a) * b_from_a;
  EXPECT_TRUE(left.matrix().isApprox((b_from_a * Rigid3::exp(xi_a)).matrix(), 1e-12));
}

TEST(Sim3, ExpIsTheMatrixExponentialAndLogInvertsIt) {
  Rng rng(8, 0);
  for (const double angle : angles()) {
    for (const double sigma : {-3.0, -0.1, -1e-9, 0.0, 1e-5, 0.7, 3.0}) {
      Vector7d xi;
      xi << random_vector(rng), angle * random_vector(rng).normalized(), sigma;
      Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
      generator.topLeftCorner<3, 3>() =
          skew(xi.segment<3>(3)) + sigma * Eigen::Matrix3d::Identity();
      generator.topRightCorner<3, 1>() = xi.head<3>();
      const Eigen::Matrix4d oracle = generator.exp();
      const Sim3 sim = Sim3::exp(xi);
      const double size = oracle.norm();
      EXPECT_LT((sim.scale * sim.rotation.toRotationMatrix() - oracle.topLeftCorner<3, 3>()).norm(),
                1e-13 * size);
      EXPECT_LT((sim.translation - oracle.topRightCorner<3, 1>()).norm(), 1e-13 * size);
      EXPECT_LT((sim.log() - xi).norm(), 1e-12) << angle << ' ' << sigma;
    }
  }
}

TEST(Sim3, ComposesAndInverts) {
  Rng rng(9, 0);
  Vector7d xi_ba, xi_cb;
  xi_ba << random_vector(rng), random_vector(rng), 0.4;
  xi_cb << random_vector(rng), random_vector(rng), -0.9;
  const Sim3 b_from_a = Sim3::exp(xi_ba), c_from_b = Sim3::exp(xi_cb);
  const Eigen::Vector3d point_in_a = random_vector(rng);
  EXPECT_TRUE(((c_from_b * b_from_a) * point_in_a).isApprox(c_from_b * (b_from_a * point_in_a)));
  EXPECT_TRUE((b_from_a.inverse() * (b_from_a * point_in_a)).isApprox(point_in_a));
}

Sim3 random_sim3(Rng& rng, double angle, double sigma) {
  Vector7d xi;
  xi << random_vector(rng), angle * random_vector(rng).normalized(), sigma;
  return Sim3::exp(xi);
}

TEST(Sim3, AdjointMovesAPerturbationToTheOtherSide) {
  Rng rng(10, 0);
  for (int i = 0; i < 20; ++i) {
    const Sim3 b_from_a = random_sim3(rng, 1.5, rng.normal());
    Vector7d xi_a;
    xi_a << random_vector(rng), random_vector(rng), 0.5 * rng.normal();
    const Sim3 left = Sim3::exp(b_from_a.adjoint() * xi_a) * b_from_a;
    const Sim3 right = b_from_a * Sim3::exp(xi_a);
    EXPECT_LT((left * right.inverse()).log().norm(), 1e-12);
  }
}

TEST(Sim3, LeftJacobianInverseMatchesNumericDerivative) {
  Rng rng(11, 0);
  for (const double angle : angles()) {
    for (const double sigma : {-1.5, -1e-4, 0.0, 0.3, 2.0}) {
      if (angle > 3.12) continue;  // The logarithm jumps within the step.
      const Sim3 sim = random_sim3(rng, angle, sigma);
      Matrix7d numeric;
      const double step = 1e-5;
      for (int i = 0; i < 7; ++i) {
        const Vector7d delta = step * Vector7d::Unit(i);
        numeric.col(i) =
            ((Sim3::exp(delta) * sim).log() - (Sim3::exp(-delta) * sim).log()) / (2 * step);
      }
      EXPECT_LT((sim3_left_jacobian_inverse(sim.log()) - numeric).norm(),
                1e-7 * (1.0 + numeric.norm()))
          << angle << ' ' << sigma;
    }
  }
}

}  // namespace
}  // namespace waymark

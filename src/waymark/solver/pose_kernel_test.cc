// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/solver/pose_kernel.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include "waymark/geometry/rigid3.h"
#include "waymark/geometry/robust_loss.h"
#include "waymark/solver/residual.h"
#include "waymark/solver/testing/scene.h"

namespace waymark {
namespace {

/// Random observations, some with ranges, one behind the camera, padding at the end.
struct KernelInput {
  PoseWorkspace::Arrays arrays;
  PoseSegment segment;
  Rigid3 cam_from_world;
};

KernelInput make_input() {
  const auto scene = testing::make_pose_scene(
      {.num_observations = 45, .share_of_outliers = 0.3, .range_sigma = 0.01}, 3);
  KernelInput input;
  Rng rng(3, 1);
  input.cam_from_world =
      Rigid3::exp(testing::random_tangent(rng, 0.05, 0.01)) * scene.rig_from_world;
  auto& fields = input.arrays.fields;
  for (std::size_t i = 0; i < 48; ++i) {
    const bool is_padding = i >= 45;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<Eigen::Index>(axis);
      const auto& observed = scene.observations;
      const double flip = i == 7 ? -1.0 : 1.0;
      fields[kPointX + axis].push_back(is_padding ? 0.0 : observed.point_in_world[i][k]);
      fields[kBearingX + axis].push_back(is_padding ? 0.0 : flip * observed.bearing[i][k]);
      const Matrix23f w = is_padding ? Matrix23f::Zero() : observed.level_pixel_from_bearing[i];
      fields[kW00 + axis].push_back(w(0, k));
      fields[kW10 + axis].push_back(w(1, k));
    }
    const bool has_range = !is_padding && i % 3 == 0;
    fields[kInverseRange].push_back(has_range ? scene.observations.inverse_range[i] : 0.0);
    fields[kInverseRangeScale].push_back(has_range ? 100.0 : 0.0);
    fields[kWeight].push_back(is_padding ? 0.0 : rng.uniform(0.5, 2.0));
  }
  input.arrays.squared_residual.resize(48);
  input.segment = {0, 0, 48, true};
  return input;
}

struct Reference {
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double cost = 0.0;
};

Eigen::Vector3d take3(const PoseWorkspace::Arrays& arrays, std::size_t first, std::size_t i) {
  return {arrays.fields[first][i], arrays.fields[first + 1][i], arrays.fields[first + 2][i]};
}

/// One observation after the other, with the scalar residuals and losses.
Reference sum_reference(const KernelInput& input, const PoseRobust& robust) {
  Reference sum;
  for (std::size_t i = input.segment.begin; i < input.segment.end; ++i) {
    const auto& fields = input.arrays.fields;
    const Eigen::Vector3d point = input.cam_from_world * take3(input.arrays, kPointX, i);
    const Eigen::Vector3f bearing = take3(input.arrays, kBearingX, i).cast<float>();
    Matrix23f w;
    w.row(0) = take3(input.arrays, kW00, i).cast<float>().transpose();
    w.row(1) = take3(input.arrays, kW10, i).cast<float>().transpose();
    const InverseRangePoint seen = in_inverse_range(point);
    const bool ahead = is_ahead(seen, bearing);
    const Eigen::Vector2d residual = bearing_residual(seen, bearing, w);
    const double squared = ahead ? residual.squaredNorm() : kGrossSquaredResidual;
    const RobustValue value = robust.loss == PoseLoss::kHuber
                                  ? huber(squared, robust.scale_px)
                                  : geman_mcclure(squared, robust.scale_px);
    const double range_scale = fields[kInverseRangeScale][i];
    const double range = (seen.inverse_range - fields[kInverseRange][i]) * range_scale;
    const RobustValue range_value = geman_mcclure(range * range, robust.scale_px);
    const double weight = fields[kWeight][i];
    sum.cost += weight * (value.loss + range_value.loss);
    if (!ahead) continue;
    Eigen::Matrix<double, 3, 6> by_point;
    by_point.leftCols<3>().setIdentity();
    by_point.rightCols<3>() = -skew(point);
    const Eigen::Matrix<double, 2, 6> rows = bearing_residual_by_point(seen, w) * by_point;
    sum.hessian += weight * value.weight * rows.transpose() * rows;
    sum.gradient += weight * value.weight * rows.transpose() * residual;
    const Eigen::Matrix<double, 1, 6> row =
        range_residual_by_point(seen, 1.0) * range_scale * by_point;
    sum.hessian += weight * range_value.weight * row.transpose() * row;
    sum.gradient += weight * range_value.weight * row.transpose() * range;
  }
  return sum;
}

class PoseKernel : public ::testing::TestWithParam<PoseLoss> {
 protected:
  ~PoseKernel() override { hwy::SetSupportedTargetsForTest(0); }
};

TEST_P(PoseKernel, EqualsTheScalarReference) {
  const KernelInput input = make_input();
  const PoseRobust robust = {GetParam(), 2.5};
  const Reference expected = sum_reference(input, robust);
  const PoseSums sums =
      sum_normal_equations(input.arrays, input.segment, input.cam_from_world, robust);
  const double tolerance = 1e-12 * expected.hessian.norm();
  std::size_t k = 0;
  for (int a = 0; a < 6; ++a) {
    for (int b = a; b < 6; ++b) EXPECT_NEAR(sums[k++], expected.hessian(a, b), tolerance);
    EXPECT_NEAR(sums[21 + static_cast<std::size_t>(a)], expected.gradient[a], tolerance);
  }
  EXPECT_NEAR(sums[27], expected.cost, 1e-12 * expected.cost);
}

TEST_P(PoseKernel, EveryInstructionSetGivesTheSameBits) {
  KernelInput input = make_input();
  const PoseRobust robust = {GetParam(), 2.5};
  const PoseSums expected =
      sum_normal_equations(input.arrays, input.segment, input.cam_from_world, robust);
  compute_squared_residuals(input.arrays, input.segment, input.cam_from_world);
  const std::vector<double> squared = input.arrays.squared_residual;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    EXPECT_EQ(sum_normal_equations(input.arrays, input.segment, input.cam_from_world, robust),
              expected)
        << hwy::TargetName(target);
    compute_squared_residuals(input.arrays, input.segment, input.cam_from_world);
    EXPECT_EQ(input.arrays.squared_residual, squared) << hwy::TargetName(target);
    hwy::SetSupportedTargetsForTest(0);
  }
}

TEST(PoseKernelResiduals, AreThoseOfTheScalarReference) {
  KernelInput input = make_input();
  compute_squared_residuals(input.arrays, input.segment, input.cam_from_world);
  for (std::size_t i = 0; i < 45; ++i) {
    const InverseRangePoint seen =
        in_inverse_range(input.cam_from_world * take3(input.arrays, kPointX, i));
    Matrix23f w;
    w.row(0) = take3(input.arrays, kW00, i).cast<float>().transpose();
    w.row(1) = take3(input.arrays, kW10, i).cast<float>().transpose();
    const Eigen::Vector3f bearing = take3(input.arrays, kBearingX, i).cast<float>();
    const double expected = is_ahead(seen, bearing)
                                ? bearing_residual(seen, bearing, w).squaredNorm()
                                : kGrossSquaredResidual;
    EXPECT_NEAR(input.arrays.squared_residual[i], expected, 1e-9 * (1.0 + expected));
  }
  EXPECT_EQ(input.arrays.squared_residual[7], kGrossSquaredResidual);
}

INSTANTIATE_TEST_SUITE_P(Losses,
                         PoseKernel,
                         ::testing::Values(PoseLoss::kGemanMcClure, PoseLoss::kHuber));

}  // namespace
}  // namespace waymark

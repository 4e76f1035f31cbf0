// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/solver/bundle_kernel.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <Eigen/Core>
#include <memory>

#include "waymark/base/rng.h"
#include "waymark/camera/perspective.h"
#include "waymark/geometry/robust_loss.h"
#include "waymark/solver/residual.h"
#include "waymark/solver/schur_equations.h"

namespace waymark {
namespace {

constexpr std::size_t kNumPoses = 5, kNumPoints = 37;

Eigen::Vector3d cube_vector(Rng& rng) {
  return {rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)};
}

Rigid3 cube_pose(Rng& rng, double size) {
  Vector6d xi;
  xi << cube_vector(rng), cube_vector(rng);
  return Rigid3::exp(size * xi);
}

/// Two cameras; each point is seen by all poses, some by both cameras of one. One residual in ten
/// is of a wrong match, one point behind the cameras.
struct BundleKernelScene {
  explicit BundleKernelScene(bool has_ranges) {
    Rng rng(3, 0);
    const auto camera = std::make_shared<PerspectiveCamera>(
        PerspectiveModel({300.0, 300.0}, {159.5, 119.5}), 320, 240);
    rig.cameras = {{camera, Rigid3()}, {camera, cube_pose(rng, 0.2)}};
    for (std::size_t i = 0; i < kNumPoses; ++i) {
      problem.rig_from_world.push_back(cube_pose(rng, 0.3));
      problem.rigs.push_back(&rig);
      problem.is_pose_fixed.push_back(i == 1);
    }
    for (std::uint32_t p = 0; p < kNumPoints; ++p) {
      problem.points.push_back(cube_vector(rng) + Eigen::Vector3d(0.0, 0.0, p == 7 ? -9.0 : 6.0));
      for (std::uint32_t pose = 0; pose < kNumPoses; ++pose) {
        add(pose, p, 0, has_ranges && p % 3 != 0, rng);
        if (p % 4 == 0) add(pose, p, 1, false, rng);
      }
    }
  }

  void add(std::uint32_t pose, std::uint32_t point, std::uint8_t camera, bool has_range, Rng& rng) {
    BundleObservation seen;
    seen.pose = pose, seen.point = point, seen.camera = camera;
    const double off = rng.uniform() < 0.1 ? 0.2 : 0.003;
    const Eigen::Vector3d in_cam =
        rig.cameras[camera].cam_from_rig * (problem.rig_from_world[pose] * problem.points[point]);
    const Eigen::Vector3d bearing =
        (in_cam.z() > 0.0 ? in_cam.normalized() : -in_cam.normalized()) + off * cube_vector(rng);
    seen.bearing = bearing.normalized().cast<float>();
    seen.level_pixel_from_bearing.setRandom();
    seen.level_pixel_from_bearing *= 300.0f;
    if (has_range) {
      seen.inverse_range_sigma = 0.01f;
      seen.inverse_range = static_cast<float>(1.0 / in_cam.norm() + 0.02 * rng.uniform(-1.0, 1.0));
    }
    problem.observations.push_back(seen);
  }

  Rig rig;
  BundleProblem problem;
};

/// What the kernel gives.
struct BundleKernelSums {
  double loss = 0.0;
  std::vector<double> poses, points, point_gradients, links;
};

/// All of it, as the solver has it.
struct BundleKernelInput {
  explicit BundleKernelInput(const BundleProblem& problem)
      : plan(make_schur_structure(problem,
                                  std::vector<std::uint8_t>(problem.observations.size(), 1))) {
    for (const Rigid3& pose : problem.rig_from_world) poses.push_back(matrix_of(pose));
    for (const RigCamera& camera : problem.rigs[0]->cameras) {
      cameras.push_back(matrix_of(camera.cam_from_rig));
    }
    const std::vector<std::size_t> first_camera(problem.rig_from_world.size(), 0);
    arrays = gather_bundle_observations(problem, plan.observations, first_camera);
    places = {poses[0].rotation.data(), cameras[0].rotation.data(), problem.points[0].data()};
  }

  BundleKernelSums run() const {
    BundleKernelSums result;
    result.loss = sum_bundle_losses(arrays, places, loss, 0, arrays.count);
    result.poses.assign(kPaddedPoseSize * plan.num_slots, 0.0);
    result.points.assign(9 * plan.points.size(), 1e9);
    result.point_gradients.assign(3 * plan.points.size(), 1e9);
    result.links.assign(18 * (plan.slot_of_link.size() + 1), 0.0);
    sum_bundle_equations(arrays,
                         places,
                         loss,
                         {plan.first_observation, plan.link_of_observation, plan.slot_of_link},
                         {result.poses.data(),
                          result.points.data(),
                          result.point_gradients.data(),
                          result.links.data()});
    return result;
  }

  SchurStructure plan;
  std::vector<RigidMatrix> poses, cameras;
  BundleArrays arrays;
  BundlePlaces places{};
  BundleLoss loss{1.5, 1.0};
};

/// Rows of an observation, by shift and turn of the pose, point, and the residual, weighted.
using DenseRow = Eigen::Matrix<double, 1, 10>;

void add_row(const Eigen::RowVector3d& by_cam,
             double residual,
             double root,
             const BundleKernelInput& input,
             const BundleObservation& seen,
             const Eigen::Vector3d& in_rig,
             std::vector<DenseRow>& rows) {
  const Eigen::RowVector3d by_rig = by_cam * input.cameras[seen.camera].rotation;
  DenseRow row;
  row << by_rig, in_rig.cross(by_rig.transpose()).transpose(),
      by_rig * input.poses[seen.pose].rotation, residual;
  rows.push_back(root * row);
}

/// The scalar reference, with one residual along the other where the loss is linear. Adds the loss.
std::vector<DenseRow> dense_rows_of(const BundleKernelInput& input,
                                    const BundleProblem& problem,
                                    const BundleObservation& seen,
                                    double& loss) {
  const Eigen::Vector3d in_rig = apply(input.poses[seen.pose], problem.points[seen.point]);
  const InverseRangePoint point = in_inverse_range(apply(input.cameras[seen.camera], in_rig));
  std::vector<DenseRow> rows;
  if (!is_ahead(point, seen.bearing)) {
    loss += huber(kGrossSquaredResidual, input.loss.huber_px).loss;
    return rows;
  }
  const Eigen::Vector2d off = bearing_residual(point, seen.bearing, seen.level_pixel_from_bearing);
  const RobustValue robust = huber(off.squaredNorm(), input.loss.huber_px);
  loss += robust.loss;
  const Matrix23d by_cam = bearing_residual_by_point(point, seen.level_pixel_from_bearing);
  const bool is_linear = robust.weight < 1.0;
  const double root = std::sqrt(robust.weight);
  const double bend = is_linear ? std::sqrt(kLinearCurvature) : 1.0;
  Eigen::Matrix2d turn = Eigen::Matrix2d::Identity();
  if (is_linear) turn << off[0], off[1], -off[1], off[0];
  if (is_linear) turn /= off.norm();
  const Matrix23d turned = turn * by_cam;
  add_row(bend * turned.row(0), (turn * off)[0] / bend, root, input, seen, in_rig, rows);
  add_row(turned.row(1), (turn * off)[1], root, input, seen, in_rig, rows);
  if (!(seen.inverse_range_sigma > 0.0f)) return rows;
  const double sigma = seen.inverse_range_sigma;
  const double range = range_residual(point, seen.inverse_range, sigma);
  const RobustValue of_range = huber(range * range, input.loss.range_huber);
  loss += of_range.loss;
  const double range_bend = of_range.weight < 1.0 ? std::sqrt(kLinearCurvature) : 1.0;
  add_row(range_bend * range_residual_by_point(point, sigma),
          range / range_bend,
          std::sqrt(of_range.weight),
          input,
          seen,
          in_rig,
          rows);
  return rows;
}

void expect_alike(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, const std::string& what) {
  EXPECT_LT((a - b).norm(), 1e-11 * (1.0 + b.norm())) << what;
}

class BundleKernel : public ::testing::TestWithParam<bool> {
 protected:
  ~BundleKernel() override { hwy::SetSupportedTargetsForTest(0); }
};

TEST_P(BundleKernel, EqualsTheScalarReference) {
  const BundleKernelScene scene(GetParam());
  const BundleKernelInput input(scene.problem);
  EXPECT_EQ(input.arrays.has_ranges, GetParam());
  const BundleKernelSums result = input.run();
  double loss = 0.0;
  std::vector<Eigen::Matrix<double, 6, 7>> poses(input.plan.num_slots,
                                                 Eigen::Matrix<double, 6, 7>::Zero());
  std::vector<Eigen::Matrix<double, 3, 4>> points(kNumPoints, Eigen::Matrix<double, 3, 4>::Zero());
  std::vector<Matrix63d> links(input.plan.slot_of_link.size(), Matrix63d::Zero());
  for (std::size_t k = 0; k < input.plan.observations.size(); ++k) {
    const BundleObservation& seen = scene.problem.observations[input.plan.observations[k]];
    for (const DenseRow& row : dense_rows_of(input, scene.problem, seen, loss)) {
      const Eigen::Matrix<double, 1, 4> by_point = row.tail<4>();
      points[seen.point] += by_point.head<3>().transpose() * by_point;
      const std::uint32_t link = input.plan.link_of_observation[k];
      if (link == kNoSlot) continue;
      links[link] += row.head<6>().transpose() * by_point.head<3>();
      Eigen::Matrix<double, 1, 7> by_pose;
      by_pose << row.head<6>(), row[9];
      poses[input.plan.slot_of_link[link]] += row.head<6>().transpose() * by_pose;
    }
  }
  EXPECT_NEAR(result.loss, loss, 1e-12 * loss);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Map<const Eigen::Matrix<double, 8, 7>> sums(result.poses.data() +
                                                             kPaddedPoseSize * i);
    Eigen::Matrix<double, 6, 7> both;
    both << sums.topRows<3>(), sums.middleRows<3>(4);
    expect_alike(both, poses[i], "pose");
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    Eigen::Matrix<double, 3, 4> both;
    both << Eigen::Map<const Eigen::Matrix3d>(result.points.data() + 9 * i),
        Eigen::Map<const Eigen::Vector3d>(result.point_gradients.data() + 3 * i);
    expect_alike(both, points[i], "point");
  }
  for (std::size_t i = 0; i < links.size(); ++i) {
    expect_alike(Eigen::Map<const Matrix63d>(result.links.data() + 18 * i), links[i], "link");
  }
}

TEST_P(BundleKernel, GivesTheSameBitsForEveryInstructionSet) {
  const BundleKernelScene scene(GetParam());
  const BundleKernelInput input(scene.problem);
  const BundleKernelSums best = input.run();
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    const BundleKernelSums result = input.run();
    EXPECT_EQ(result.loss, best.loss) << hwy::TargetName(target);
    EXPECT_EQ(result.points, best.points) << hwy::TargetName(target);
    EXPECT_EQ(result.point_gradients, best.point_gradients) << hwy::TargetName(target);
    EXPECT_EQ(result.links, best.links) << hwy::TargetName(target);
    EXPECT_EQ(result.poses, best.poses) << hwy::TargetName(target);
    hwy::SetSupportedTargetsForTest(0);
  }
}

INSTANTIATE_TEST_SUITE_P(Problems, BundleKernel, ::testing::Bool(), [](const auto& info) {
  return std::string(info.param ? "WithRanges" : "OfBearings");
});

}  // namespace
}  // namespace waymark

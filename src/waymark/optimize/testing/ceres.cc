// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/testing/ceres.h"

#include <ceres/ceres.h>

#include <array>
#include <memory>
#include <vector>

#include "waymark/solver/residual.h"

namespace waymark::testing {

namespace {

/// Translation, then the quaternion as x, y, z, w.
using PoseBlock = std::array<double, 7>;

PoseBlock block_from(const Rigid3& pose) {
  PoseBlock block;
  Eigen::Map<Eigen::Vector3d>(block.data()) = pose.translation;
  Eigen::Map<Eigen::Vector4d>(block.data() + 3) = pose.rotation.coeffs();
  return block;
}

Rigid3 pose_from(const double* block) {
  return {Eigen::Quaterniond(block + 3), Eigen::Vector3d(block[0], block[1], block[2])};
}

/// Left perturbation. The cost functions below hand over derivatives by the tangent vector in the
/// first six columns of those by the block, so that the derivative of plus selects them.
class LeftPerturbation : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }

  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const PoseBlock moved =
        block_from(Rigid3::exp(Eigen::Map<const Vector6d>(delta)) * pose_from(x));
    std::copy(moved.begin(), moved.end(), x_plus_delta);
    return true;
  }

  bool PlusJacobian(const double* /*x*/, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> map(jacobian);
    map.setIdentity();
    return true;
  }

  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    Eigen::Map<Vector6d> difference(y_minus_x);
    difference = (pose_from(y) * pose_from(x).inverse()).log();
    return true;
  }

  bool MinusJacobian(const double* /*x*/, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>> map(jacobian);
    map.setIdentity();
    return true;
  }
};

/// kSize 2: the bearing; 1: the range.
template <int kSize>
class ObservationCost : public ceres::SizedCostFunction<kSize, 7, 3> {
 public:
  ObservationCost(const BundleObservation& observation, const Rigid3& cam_from_rig)
      : observation_(observation), cam_from_rig_(cam_from_rig) {}

  bool Evaluate(const double* const* parameters,
                double* residuals,
                double** jacobians) const override {
    const Rigid3 rig_from_world = pose_from(parameters[0]);
    const Eigen::Vector3d point_in_rig =
        rig_from_world * Eigen::Map<const Eigen::Vector3d>(parameters[1]);
    const InverseRangePoint seen = in_inverse_range(cam_from_rig_ * point_in_rig);
    Eigen::Map<Eigen::Matrix<double, kSize, 1>> residual(residuals);
    Eigen::Matrix<double, kSize, 3> by_point_in_cam;
    if (is_ahead(seen, observation_.bearing)) {
      fill(seen, residual, by_point_in_cam);
    } else {
      residual.setZero();
      if (kSize == 2) residual[0] = std::sqrt(kGrossSquaredResidual);
      by_point_in_cam.setZero();
    }
    if (jacobians == nullptr) return true;
    const Eigen::Matrix<double, kSize, 3> by_rig =
        by_point_in_cam * cam_from_rig_.rotation_matrix();
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, kSize, 7, Eigen::RowMajor>> by_pose(jacobians[0]);
      by_pose.setZero();
      by_pose.template leftCols<3>() = by_rig;
      for (int row = 0; row < kSize; ++row) {
        const Eigen::Vector3d gradient = by_rig.row(row).transpose();
        by_pose.template block<1, 3>(row, 3) = point_in_rig.cross(gradient).transpose();
      }
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, kSize, 3, Eigen::RowMajor>> by_point(jacobians[1]);
      by_point = by_rig * rig_from_world.rotation_matrix();
    }
    return true;
  }

 private:
  template <class Residual, class Jacobian>
  void fill(const InverseRangePoint& seen, Residual& residual, Jacobian& by_point_in_cam) const {
    if constexpr (kSize == 2) {
      const Matrix23f& w = observation_.level_pixel_from_bearing;
      residual = bearing_residual(seen, observation_.bearing, w);
      by_point_in_cam = bearing_residual_by_point(seen, w);
    } else {
      const double sigma = observation_.inverse_range_sigma;
      residual[0] = range_residual(seen, observation_.inverse_range, sigma);
      by_point_in_cam = range_residual_by_point(seen, sigma);
    }
  }

  const BundleObservation& observation_;
  const Rigid3& cam_from_rig_;
};

ceres::Problem::Options problem_options() {
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return options;
}

/// Returns the number of free poses.
int add_blocks(const BundleProblem& problem,
               std::span<const std::uint8_t> is_used,
               std::vector<PoseBlock>& poses,
               std::vector<Eigen::Vector3d>& points,
               ceres::Manifold* manifold,
               ceres::Problem& ceres_problem,
               ceres::ParameterBlockOrdering& ordering) {
  std::vector<std::uint8_t> is_pose_used(poses.size(), 0);
  std::vector<std::uint8_t> is_point_used(points.size(), 0);
  for (std::size_t i = 0; i < is_used.size(); ++i) {
    if (!is_used[i]) continue;
    is_pose_used[problem.observations[i].pose] = 1;
    is_point_used[problem.observations[i].point] = 1;
  }
  int num_free = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!is_pose_used[i]) continue;
    ceres_problem.AddParameterBlock(poses[i].data(), 7, manifold);
    ordering.AddElementToGroup(poses[i].data(), 1);
    if (problem.is_pose_fixed[i]) {
      ceres_problem.SetParameterBlockConstant(poses[i].data());
    } else {
      ++num_free;
    }
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!is_point_used[i]) continue;
    ceres_problem.AddParameterBlock(points[i].data(), 3);
    ordering.AddElementToGroup(points[i].data(), 0);
  }
  return num_free;
}

void add_residuals(const BundleProblem& problem,
                   std::span<const std::uint8_t> is_used,
                   std::vector<PoseBlock>& poses,
                   std::vector<Eigen::Vector3d>& points,
                   ceres::LossFunction* loss,
                   ceres::LossFunction* range_loss,
                   ceres::Problem& ceres_problem) {
  for (std::size_t i = 0; i < is_used.size(); ++i) {
    if (!is_used[i]) continue;
    const BundleObservation& observation = problem.observations[i];
    const Rigid3& cam_from_rig =
        problem.rigs[observation.pose]->cameras[observation.camera].cam_from_rig;
    double* pose = poses[observation.pose].data();
    double* point = points[observation.point].data();
    ceres_problem.AddResidualBlock(
        new ObservationCost<2>(observation, cam_from_rig), loss, pose, point);
    if (!(observation.inverse_range_sigma > 0.0f)) continue;
    ceres_problem.AddResidualBlock(
        new ObservationCost<1>(observation, cam_from_rig), range_loss, pose, point);
  }
}

}  // namespace

BundleRound minimize_with_ceres(BundleProblem& problem,
                                std::span<const std::uint8_t> is_used,
                                const BundleOptions& options) {
  std::vector<PoseBlock> poses;
  for (const Rigid3& pose : problem.rig_from_world) poses.push_back(block_from(pose));
  LeftPerturbation manifold;
  ceres::HuberLoss loss(options.huber_px);
  ceres::HuberLoss range_loss(options.range_huber);
  ceres::Problem ceres_problem(problem_options());
  const auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  const int num_free =
      add_blocks(problem, is_used, poses, problem.points, &manifold, ceres_problem, *ordering);
  add_residuals(problem, is_used, poses, problem.points, &loss, &range_loss, ceres_problem);

  ceres::Solver::Options solver_options;
  solver_options.num_threads = static_cast<int>(options.num_threads);
  solver_options.max_num_iterations = options.max_iterations_per_round;
  solver_options.function_tolerance = options.relative_cost_tolerance;
  solver_options.linear_solver_type = num_free <= 60 ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
  solver_options.linear_solver_ordering = ordering;
  solver_options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  if (ceres_problem.NumResidualBlocks() > 0) {
    ceres::Solve(solver_options, &ceres_problem, &summary);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (!problem.is_pose_fixed[i]) problem.rig_from_world[i] = pose_from(poses[i].data());
    }
    return {summary.initial_cost,
            summary.final_cost,
            summary.num_successful_steps + summary.num_unsuccessful_steps - 1};
  }
  return {};
}

}  // namespace waymark::testing

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Core>
#include <type_traits>

#include "waymark/solver/schur_equations.h"

namespace waymark {
namespace {

/// Keeps the scale where it is, which mono does not tell, where no step is to be taken.
constexpr double kLeastDamping = 1e-8;

}  // namespace

void SchurSolver::move_cameras(BundleState& state) const {
  const BundleCalibration& calibration = *problem_.calibration;
  const auto pose = std::ranges::find(problem_.rigs, calibration.rig);
  if (pose == problem_.rigs.end()) return;
  const std::size_t first = first_camera_[static_cast<std::size_t>(pose - problem_.rigs.begin())];
  for (std::size_t c = 0; c < calibration.blocks.size(); ++c) {
    state.cameras[first + c] = matrix_of(calibration.cam_from_rig(c, state.calibration));
  }
}

Eigen::MatrixXd CalibrationEvidence::scatter_after(const Eigen::VectorXd& step) const {
  const auto count = static_cast<double>(parts.size());
  const Eigen::VectorXd mean = (whole.gradient + whole.information * step) / count;
  Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(step.size(), step.size());
  for (const CalibrationTold& part : parts) {
    const Eigen::VectorXd off = part.gradient + part.information * step - mean;
    scatter += off * off.transpose();
  }
  return scatter * (count / (count - 1.0));
}

/// What each observation of a point tells of the calibration, all else following. Of equations that
/// were reduced: point and links are times M.
void SchurSolver::add_told(std::size_t entry) {
  Eigen::MatrixX3d calibration_by_point = border_->of_point(entry);
  for (std::uint32_t link = plan_.first_link[entry]; link < plan_.first_link[entry + 1]; ++link) {
    calibration_by_point -=
        border_->solved(plan_.slot_of_link[link]).lazyProduct(blocks_.links[link]);
  }
  calibration_by_point = -calibration_by_point.lazyProduct(half_inverses_[entry]).eval();
  Eigen::MatrixX3d told(calibration_by_point.rows(), 3);  // Of the rows of an observation.
  for (std::size_t k = plan_.first_observation[entry]; k < plan_.first_observation[entry + 1];
       ++k) {
    const std::size_t i = plan_.observations[k];
    const BundleObservation& observation = problem_.observations[i];
    const std::uint32_t slot = plan_.slot_of_pose[observation.pose];
    visit_rows(i, [&](const auto& rows, const Eigen::Vector3d& point_in_rig) {
      const auto by = jacobians(rows, i, point_in_rig);
      auto total = told.leftCols<std::decay_t<decltype(rows.residual)>::RowsAtCompileTime>();
      total = calibration_by_point.lazyProduct(by.by_point.transpose());
      if (slot != kNoSlot) total -= border_->solved(slot).lazyProduct(by.by_pose.transpose());
      if (const BundleCalibration* calibration = problem_.calibration_of(observation.pose)) {
        const auto first = static_cast<Eigen::Index>(calibration->blocks[observation.camera].first);
        total.middleRows(first, by.by_calibration.rows()) += by.by_calibration;
      }
      border_->add_told(observation.pose, problem_.rigs.size(), total, rows.residual);
    });
  }
}

CalibrationEvidence SchurSolver::calibration_evidence() {
  linearize();
  reduce(kLeastDamping);
  if (!solve_reduced()) return {};
  for (std::size_t entry = 0; entry < plan_.points.size(); ++entry) add_told(entry);
  return border_->evidence();
}

}  // namespace waymark

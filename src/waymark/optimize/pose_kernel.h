// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "waymark/geometry/rigid3.h"
#include "waymark/optimize/pose_arrays.h"

namespace waymark {

enum class PoseLoss { kGemanMcClure, kHuber };

/// The loss of the bearing residuals; ranges always take Geman and McClure's.
struct PoseRobust {
  PoseLoss loss = PoseLoss::kGemanMcClure;
  double scale_px = 1.0;
};

/// Normal equations by a left perturbation of the pose: the upper triangle of the Hessian
/// approximation row by row (21), the gradient (6) and the robust cost, all without the factor 2
/// of the derivative of a square. Summed in kPoseLanes interleaved partial sums, whatever the width
/// of the vectors, and without fused multiply-add, so that every instruction set gives the same
/// bits.
inline constexpr std::size_t kNumPoseSums = 28;
using PoseSums = std::array<double, kNumPoseSums>;

PoseSums sum_normal_equations(const PoseWorkspace::Arrays& arrays,
                              const PoseSegment& segment,
                              const Rigid3& cam_from_world,
                              const PoseRobust& robust);

/// Fills arrays.squared_residual of the segment, whatever the weights.
void compute_squared_residuals(PoseWorkspace::Arrays& arrays,
                               const PoseSegment& segment,
                               const Rigid3& cam_from_world);

}  // namespace waymark

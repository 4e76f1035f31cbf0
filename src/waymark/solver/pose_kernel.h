// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/camera/rig.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/solver/pose_observations.h"

namespace waymark {

/// Observations come in blocks of as many; see sum_normal_equations.
inline constexpr std::size_t kPoseLanes = 8;

/// The observations of one camera: entries [begin, end) of the arrays, a multiple of kPoseLanes.
struct PoseSegment {
  std::size_t camera = 0;
  std::size_t begin = 0;
  std::size_t end = 0;
  bool has_ranges = false;  // Any of them.
};

/// Columns of PoseWorkspace::Arrays.
enum PoseField : std::size_t {
  kPointX,
  kPointY,
  kPointZ,
  kBearingX,
  kBearingY,
  kBearingZ,
  kW00,
  kW01,
  kW02,
  kW10,
  kW11,
  kW12,
  kInverseRange,
  kInverseRangeScale,  // 1 / sigma; 0 without a measurement.
  kWeight,             // 1, or 0 where the observation is out.
  kNumPoseFields
};

/// The observations column by column, grouped by camera and padded with entries of weight 0. All
/// values are finite.
struct PoseWorkspace::Arrays {
  std::array<std::vector<double>, kNumPoseFields> fields;
  std::vector<double> squared_residual;    // px^2; kGrossSquaredResidual behind the bearing.
  std::vector<std::uint32_t> observation;  // Index given by the caller, UINT32_MAX in padding.
  std::vector<PoseSegment> segments;
  std::vector<double> scratch;
  std::vector<std::uint8_t> is_inlier;  // In the caller's order.
};

/// Copies what can be used of the observations, by camera. Returns how many these are.
std::size_t gather_pose_observations(const Rig& rig,
                                     const PoseObservations& observations,
                                     PoseWorkspace::Arrays& arrays);

struct PoseClasses {
  std::size_t num_inliers = 0;
  std::size_t num_changed = 0;  // Since the call before.
};

/// Sets is_inlier where squared_residual is below the gate and gives the others the weight 0.
PoseClasses classify_pose_observations(double gate, PoseWorkspace::Arrays& arrays);

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

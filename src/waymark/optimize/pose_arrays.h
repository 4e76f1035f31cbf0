// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/optimize/pose.h"

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
  kInverseRangeScale,  // 1 / sigma in units of the pixel noise; 0 without a measurement.
  kWeight,             // 0 takes the observation out.
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

/// Copies what can be used of the observations, by camera. Returns how many these are. noise_px is
/// the unit of the ranges.
std::size_t gather_pose_observations(const Rig& rig,
                                     const PoseObservations& observations,
                                     double noise_px,
                                     PoseWorkspace::Arrays& arrays);

struct PoseClasses {
  std::size_t num_inliers = 0;
  std::size_t num_changed = 0;  // Since the call before.
};

/// Sets is_inlier where squared_residual is below the gate and gives the others the weight 0.
PoseClasses classify_pose_observations(const PoseObservations& observations,
                                       double gate,
                                       PoseWorkspace::Arrays& arrays);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "waymark/solver/bundle_problem.h"

namespace waymark {

/// Observations come in blocks of as many; sums run in as many interleaved partial sums, whatever
/// the width of the vectors, and without fused operations: every instruction set gives the same
/// bits.
inline constexpr std::size_t kBundleLanes = 8;

/// Columns of BundleArrays.
enum BundleField : std::size_t {
  kSeenBearingX,
  kSeenBearingY,
  kSeenBearingZ,
  kSeenW00,
  kSeenW01,
  kSeenW02,
  kSeenW10,
  kSeenW11,
  kSeenW12,
  kSeenInverseRange,
  kSeenInverseSigma,  // 0 without a range.
  kNumBundleFields
};

/// The used observations of a problem column by column, padded to whole blocks. All are finite.
struct BundleArrays {
  std::size_t count = 0;
  bool has_ranges = false;  // Any of them.
  std::array<std::vector<double>, kNumBundleFields> fields;
  // Where in the tables of BundlePlaces their pose, camera and point begin.
  std::array<std::vector<std::int64_t>, 3> places;
};

/// Copies observations; cameras: place of camera 0 of each pose in the table of cameras.
BundleArrays gather_bundle_observations(const BundleProblem& problem,
                                        std::span<const std::uint32_t> observations,
                                        std::span<const std::size_t> first_camera);

/// Poses and cameras as rotation by columns and translation, 12 numbers each; points as 3.
struct BundlePlaces {
  const double* rig_from_world;
  const double* cam_from_rig;
  const double* points;
};

/// Residual lengths where Huber's losses turn linear.
/// Of the curvature that a weighted square has along its residual, the share that is counted where
/// Huber's loss is linear. The loss has none there (Triggs et al. 2000, 4.3), but does again within
/// its scale: with all of it steps fall short and each round converges linearly, with half of it
/// they go too far (docs/decisions/optimize.md).
inline constexpr double kLinearCurvature = 0.6;

struct BundleLoss {
  double huber_px;
  double range_huber;
};

/// Twice the robust cost of observations [begin, end); begin: that of a block.
double sum_bundle_losses(const BundleArrays& arrays,
                         const BundlePlaces& places,
                         const BundleLoss& loss,
                         std::size_t begin,
                         std::size_t end);

/// Normal equations; see NormalBlocks. Poses are padded: six columns of the Hessian and one of the
/// gradient, of kPaddedPoseRows rows each: those by the shift, one of junk, those by the turn, one
/// of zeros. To poses and links is added; the links have one more at the end, for reading. Of
/// points what was before is overwritten.
struct BundleSums {
  double* poses;
  double* points;
  double* point_gradients;
  double* links;
};
inline constexpr std::size_t kPaddedPoseRows = 8;
inline constexpr std::size_t kPaddedPoseSize = 7 * kPaddedPoseRows;

/// Of the observations by point and pose; as in SchurStructure.
struct BundleLinks {
  std::span<const std::uint32_t> first_observation;    // Per point, and one past the end.
  std::span<const std::uint32_t> link_of_observation;  // UINT32_MAX: the pose is fixed.
  std::span<const std::uint32_t> slot_of_link;
};

/// Adds up the normal equations of all observations, each weighted by its loss.
void sum_bundle_equations(const BundleArrays& arrays,
                          const BundlePlaces& places,
                          const BundleLoss& loss,
                          const BundleLinks& links,
                          const BundleSums& sums);

}  // namespace waymark

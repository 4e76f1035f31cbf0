// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "waymark/geometry/rigid3.h"

namespace waymark {

/// Mean relative error over path segments of one length.
struct SegmentError {
  double length_m = 0.0;               ///< Along the true path.
  double translation_percent = 0.0;    ///< Position error at the end, in percent of the length.
  double rotation_deg_per_100m = 0.0;  ///< Angle error at the end, per 100 m of length.
  std::size_t num_segments = 0;        ///< That the mean is over.
};

/// The measure of the KITTI odometry benchmark (Geiger et al. 2012).
struct SegmentErrors {
  SegmentError all;                     ///< Mean over all segments; its length is the mean length.
  std::vector<SegmentError> by_length;  ///< 100, 200, ... 800 m, those that occur.
};

/// Poses world_from_camera, paired one to one, both metric in the same unit. Every tenth pose
/// starts a segment of each length along the true path. Nothing when the path is shorter than 100
/// m.
std::optional<SegmentErrors> segment_errors(std::span<const Rigid3> estimate,
                                            std::span<const Rigid3> groundtruth);

}  // namespace waymark

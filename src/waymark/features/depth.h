// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "waymark/features/features.h"
#include "waymark/features/settings.h"
#include "waymark/image/image.h"

namespace waymark {

/// Range along its bearing of each keypoint, from a depth image that is registered to the camera
/// (depth along z), and the standard deviation of the inverse range. Both are 0 where the image
/// has no measurement, or not in front. A corner at the edge of a surface belongs to the nearer
/// side. keypoints, bearings and level_pixel_from_bearing (of full rank) are those of Features, in
/// parallel; the last num_edges are points on edges, whose place along the edge is uncertain.
void sample_depth(DepthView depth,
                  const DepthSettings& settings,
                  std::span<const Keypoint> keypoints,
                  std::span<const Eigen::Vector3f> bearings,
                  std::span<const Matrix23f> level_pixel_from_bearing,
                  std::size_t num_edges,
                  FeatureArray<float>& range_m,
                  FeatureArray<float>& inverse_range_sigma);

}  // namespace waymark

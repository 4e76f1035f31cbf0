// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <span>
#include <vector>

#include "waymark/camera/camera.h"
#include "waymark/camera/rig.h"
#include "waymark/features/feature_grid.h"

namespace waymark {

/// A corner, or a point on an edge, in the image of one camera of the rig. Pixel of level 0,
/// sub-pixel.
struct Keypoint {
  float x_px = 0.0f;  ///< To the right; 0 is the centre of the leftmost pixels.
  float y_px = 0.0f;  ///< Down; 0 is the centre of the top pixels.
  /// Orientation of the patch, or across the edge to the lighter side; clockwise as y points down.
  float angle_rad = 0.0f;
  float response = 0.0f;    ///< Corner score, or slope; comparable within one image only.
  std::uint8_t level = 0;   ///< Pyramid level it was found at.
  std::uint8_t camera = 0;  ///< Index in the rig.
};

/// 256 bits of rotated BRIEF.
using Descriptor = std::array<std::uint64_t, 4>;

/// In place of the index of a feature: none.
inline constexpr std::uint32_t kNoFeature = UINT32_MAX;

/// How what is seen moves past the rig, in its frame: a point at X moves by shift + turn x X. All 0
/// where that is not known.
struct RigMotion {
  Eigen::Vector3f turn_rad_s = Eigen::Vector3f::Zero();   ///< That of rig_from_world.
  Eigen::Vector3f shift_per_s = Eigen::Vector3f::Zero();  ///< In metres (map units for mono).
  float inverse_range = 0.0f;  ///< Of what is seen, in the median; 1/m (1 / map units).

  friend bool operator==(const RigMotion&, const RigMotion&) = default;
};

/// The unit vector across an edge in the image, to its lighter side. angle_rad: of its keypoint.
inline Eigen::Vector2f edge_normal(float angle_rad) {
  return {std::cos(angle_rad), std::sin(angle_rad)};
}

/// How much surer than a corner's place that of a line through nine places of an edge is.
/// (docs/decisions/image.md)
inline constexpr float kEdgePrecision = 2.0f;

/// What an edge leaves of W: n n^T W, n being its normal in the image. Residuals are in pixels of
/// its level over kEdgePrecision, so that one is as likely as one of a corner.
inline Matrix23f across_edge(const Matrix23f& level_pixel_from_bearing, float angle_rad) {
  const Eigen::Vector2f normal = edge_normal(angle_rad);
  return kEdgePrecision * normal * (normal.transpose() * level_pixel_from_bearing).eval();
}

/// One of the arrays of features.
template <class T>
using FeatureArray = std::pmr::vector<T>;

/// The immutable data of a frame. Arrays run in parallel: first the num_primary features of
/// camera 0, which have descriptors, then those that stereo search found in camera 1, which have
/// none and belong to a primary feature. Where corners are few the last of the primary features are
/// points on edges, which tell their place across the edge only. A copy lies on the heap, wherever
/// what it is of does; see stored_in().
struct Features {
  /// The cameras that measured all this, as calibrated then; null only while it is being made.
  std::shared_ptr<const Rig> rig;
  std::size_t num_primary = 0;             ///< Features of camera 0.
  std::size_t num_edges = 0;               ///< The last of these are points on edges.
  FeatureArray<Keypoint> keypoints;        ///< All features; pixels are those of each one's camera.
  FeatureArray<Descriptor> descriptors;    ///< num_primary entries.
  FeatureArray<Eigen::Vector3f> bearings;  ///< Unit, in the frame of the feature's camera.
  /// Derivative of the pixel of the feature's level by the bearing, at the measured bearing (W).
  /// The residual of a landmark is W * (predicted bearing - measured bearing). On edges W has rank
  /// 1 and gives what is across, see across_edge().
  FeatureArray<Matrix23f> level_pixel_from_bearing;
  FeatureArray<float> size_rad;  ///< Angle of one pixel of the feature's level.
  /// The feature of camera 1 that belongs to a primary feature, and back; kNoFeature where none.
  FeatureArray<std::uint32_t> partner;
  /// Distance along the bearing in metres, from stereo or the depth image; 0 where unknown,
  /// negative where the two cameras see the feature beyond infinity, as noise makes them do with
  /// what is far away. num_primary entries.
  FeatureArray<float> range_m;
  /// Standard deviation of the inverse range in 1/m; 0 where there is no range.
  FeatureArray<float> inverse_range_sigma;
  float inverse_depth_offset = 0.0f;  ///< Rig::inverse_depth_offset that the ranges were freed of.
  RigMotion motion;                   ///< At the frame's time.
  /// Per camera the readout that the keypoints are corrected for: they are where all of them would
  /// have been seen at the frame's time.
  std::array<float, 2> readout_s = {};
  FeatureGrid grid;  ///< Of the primary features, by level-0 pixel.

  /// Features of both cameras.
  std::size_t size() const { return keypoints.size(); }

  /// The primary features that are no points on edges come first.
  std::size_t num_corners() const { return num_primary - num_edges; }
  /// Whether a feature is a point on an edge.
  bool is_edge(std::size_t feature) const {
    return feature >= num_corners() && feature < num_primary;
  }
  /// What corners look like, the only ones that are known by that.
  std::span<const Descriptor> corner_descriptors() const {
    return std::span(descriptors).first(num_corners());
  }

  /// What a feature measures. Features of camera 1 are found again where those of camera 0 are,
  /// with the errors of these: what they add is the range.
  Measurement measurement(std::uint32_t feature) const {
    Measurement measured{
        keypoints[feature].camera, bearings[feature], level_pixel_from_bearing[feature]};
    if (feature < num_primary && inverse_range_sigma[feature] > 0.0f) {
      measured.inverse_range = 1.0f / range_m[feature];
      measured.inverse_range_sigma = inverse_range_sigma[feature];
    }
    return measured;
  }
};

/// A copy with all arrays one behind the other in a block of this memory.
std::shared_ptr<const Features> stored_in(std::shared_ptr<std::pmr::memory_resource> memory,
                                          const Features& features);

}  // namespace waymark

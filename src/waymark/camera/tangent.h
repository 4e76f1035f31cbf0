// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "waymark/camera/camera.h"

namespace waymark {

/// What the residual of a feature needs, arrays in parallel. Entries that are not valid are
/// unspecified.
struct TangentArrays {
  std::vector<Eigen::Vector3f> bearings;  ///< Unit, in the frame of the camera.
  /// W, 2x3: derivative of the pixel of the feature's level by the bearing, at the bearing, with
  /// W * bearing = 0. Its two singular values differ by at most TangentComputer::kMaxStretch.
  std::vector<Matrix23f> level_pixel_from_bearing;
  /// Angle of one pixel of the feature's level: the geometric mean of the singular values of W,
  /// inverted.
  std::vector<float> size_rad;
  std::vector<std::uint8_t> is_valid;  ///< 0 where the pixel has no bearing or no finite W.
};

/// Linearises a camera at measured pixels, so that the residual W * (predicted bearing - measured
/// bearing) is the reprojection error in pixels of the feature's level to first order, for every
/// camera model alike. Keeps its buffers: no allocation after warm-up.
///
/// Why W is bounded: near a pole of an equirectangular image one column spans hardly any angle, and
/// where the field of view ends one pixel may span any. The larger singular value would then claim
/// a precision that the optics do not have (the image is stretched there, hence blurred), and grow
/// without limit. It is lowered to kMaxStretch times the smaller one, which never adds information.
class TangentComputer {
 public:
  /// A perspective image reaches it at 70 degrees off axis, an equirectangular one at the latitude
  /// of 70 degrees.
  static constexpr double kMaxStretch = 3.0;

  /// Whether the singular values of a derivative of pixels by bearings differ by more than that.
  static bool is_stretched(const Matrix23d& pixel_from_bearing);

  /// pixels: of level 0; level_scales: size of one pixel of the feature's level in pixels of level
  /// 0, as many. The result stays valid until the next call.
  const TangentArrays& compute(const Camera& camera,
                               std::span<const Eigen::Vector2d> pixels,
                               std::span<const float> level_scales);

 private:
  std::vector<Eigen::Vector3d> bearings_;
  std::vector<Eigen::Vector2d> reprojected_;
  std::vector<Matrix23d> jacobians_;
  std::vector<std::uint8_t> is_visible_;
  TangentArrays arrays_;
};

}  // namespace waymark

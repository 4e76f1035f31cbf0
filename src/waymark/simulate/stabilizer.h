// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "waymark/camera/camchain.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/image/image.h"

namespace waymark {

/// Electronic stabilisation as phones and action cameras have it: of what the sensor sees a part is
/// cut out and enlarged, and the cut follows a smoothed way of the camera's turning, by a shift and
/// a turn within the image. So the picture's principal point wanders from frame to frame, which no
/// camera model describes. Positions and orientations of the camera stay what they are.
class Stabilizer {
 public:
  /// picture: as it is on the average, intrinsics ending with fu fv pu pv. world_from_cam: of each
  /// frame, num_frames at rate_hz. share: the largest shift, relative to width and height.
  Stabilizer(const CameraDescription& picture,
             const std::function<Rigid3(int frame)>& world_from_cam,
             int num_frames,
             double rate_hz,
             double share);

  /// From a pixel of a frame's picture, (x, y, 1), to that of the sensor's image.
  Eigen::Matrix<double, 2, 3> sensor_from_picture(int frame) const;

  /// The picture of a frame; resampled linearly.
  Image stabilize(const Image& sensor, int frame) const;

 private:
  /// What the cut does in one frame, in the picture.
  struct Cut {
    Eigen::Vector2d shift_px;  ///< Of what is seen.
    double turn_rad;           ///< Of what is seen, clockwise.
  };

  Eigen::Vector2d middle_px_;
  double zoom_;
  std::vector<Cut> cuts_;
};

/// The sensor behind such pictures: the same lens, seen whole.
CameraDescription sensor_of(CameraDescription picture, double share);

}  // namespace waymark

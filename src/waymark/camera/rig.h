// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Cameras that move as one body; camera 0 is the origin.
//
//   for (const RigCamera& one : rig.cameras) {
//     std::cout << one.camera->model() << " at "
//               << one.cam_from_rig.inverse().translation.transpose() << " m\n";
//   }

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "waymark/camera/bearing_error.h"
#include "waymark/camera/camera.h"
#include "waymark/geometry/rigid3.h"

namespace waymark {

/// How sure a camera's calibration is: standard deviations, 0 of what is exact. Empty lists: as
/// good as calibrations usually are (see CalibrationParameters).
struct CalibrationSigmas {
  std::vector<double> intrinsics;         ///< Of each of them, in its unit.
  std::vector<double> distortion_coeffs;  ///< Of each of them.
  std::vector<double> rotation_rad;       ///< Of the camera about its own x, y and z.
  /// Of the baseline along the columns of across_baseline(), as a turn.
  std::vector<double> baseline_direction_rad;
};

/// One camera of a rig. cam_from_rig is fixed; camera 0 is the rig's origin.
struct RigCamera {
  /// Shared by everything that looks through it; never null.
  std::shared_ptr<const Camera> camera;
  Rigid3 cam_from_rig;  ///< Translation in metres.
  /// What make_rig() made the camera of; map files hold it. A map whose cameras lack it cannot be
  /// saved.
  std::optional<CameraDescription> description = std::nullopt;
  /// Makes the camera of another description, as the registry did that make_rig() was given. Where
  /// it is missing the camera is taken as it is.
  CameraFactory remake = nullptr;
  /// Rolling shutter: from reading the first row to reading the last. A frame's time is that of the
  /// row in the middle. 0: all rows are read at once.
  double readout_s = 0.0;
  /// How sure the calibration is.
  CalibrationSigmas sigmas = {};
  /// Of the second camera of a stereo pair: what is taken out of its bearings.
  BearingError bearing_error = {};
};

/// 1..N cameras that move as one body. Mono and RGB-D have 1, stereo has 2.
struct Rig {
  std::vector<RigCamera> cameras;  ///< At least one.
  /// Of the depth images of camera 0, in 1/m: their inverse depths are too large by this, as where
  /// a projector and its camera have drifted apart.
  double inverse_depth_offset = 0.0;
};

/// The same cameras with depth images that are off by this.
inline Rig with_depth_offset(Rig rig, double inverse_depth_offset) {
  rig.inverse_depth_offset = inverse_depth_offset;
  return rig;
}

/// Whether two rigs have the same cameras at the same places, by their descriptions; a camera
/// without one is the same as itself alone.
inline bool is_same_rig(const Rig& a, const Rig& b) {
  const auto is_same_camera = [](const RigCamera& one, const RigCamera& other) {
    if (one.cam_from_rig.rotation.coeffs() != other.cam_from_rig.rotation.coeffs()) return false;
    if (one.cam_from_rig.translation != other.cam_from_rig.translation) return false;
    if (!one.description || !other.description) return one.camera == other.camera;
    return one.description->is_same(*other.description);
  };
  return &a == &b || std::ranges::equal(a.cameras, b.cameras, is_same_camera);
}

}  // namespace waymark

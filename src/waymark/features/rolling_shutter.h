// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "waymark/camera/rig.h"
#include "waymark/features/features.h"

namespace waymark {

/// When a row is read, in parts of the readout after the frame's time: -0.5 the first row, 0.5 the
/// last.
float row_delay(const Camera& camera, float y_px);

/// RigMotion::shift_per_s in the frame of a camera: how what is seen moves past that, apart from
/// its turn.
Eigen::Vector3f camera_shift(const RigMotion& motion, const RigCamera& camera);

/// How fast a bearing of a camera moves, in 1/s. inverse_range: of the point; 0: infinitely far.
Eigen::Vector3f bearing_rate(const RigMotion& motion,
                             const RigCamera& camera,
                             const Eigen::Vector3f& bearing,
                             float inverse_range);

/// The same for a feature of that camera, by its range where that is known, else by that of the
/// motion.
Eigen::Vector3f bearing_rate(const RigMotion& motion,
                             const RigCamera& camera,
                             const Features& features,
                             std::size_t feature);

/// Moves the keypoints to where they would have been seen had all rows been read at the frame's
/// time: by this motion and the readout of the cameras, in place of what they are corrected for
/// (Klein and Murray 2009; Hedborg et al. 2012). Pixels only: the geometry is to be derived anew.
/// Whether any has moved.
bool correct_rolling(const Rig& rig, const RigMotion& motion, Features& features);

}  // namespace waymark

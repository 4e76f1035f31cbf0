// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "waymark/camera/calibration.h"
#include "waymark/camera/camchain.h"
#include "waymark/session/session_options.h"

namespace waymark {

/// How far apart the pixels are, as a part of the image's width, where two calibrations of the same
/// rig have the same direction: root mean square over the image of the camera where it is most.
double image_shift(const Rig& before, const Rig& after);

/// What the input of a session is mapped once more with, from the start.
struct SecondPass {
  CameraChain calibration;
  double inverse_depth_offset = 0.0;  ///< Rig::inverse_depth_offset.
  std::string mistake = {};  ///< What was wrong with the stated one, for people; may be empty.
};

/// The calibration that the session ended with, where the one it began with is another by so much
/// that all that was tracked with it suffers; or, of one camera, the stated one with the distortion
/// that it is said not to have, where the images contradict that: see find_missing_distortion().
/// Nothing if neither is so, or where the input comes but once or at its own time.
std::optional<SecondPass> calibration_for_second_pass(const Session& session);

/// The changes of two passes, the second of which began where the first ended, as of one.
std::vector<CalibrationEstimate> join_passes(std::span<const CalibrationEstimate> first,
                                             std::vector<CalibrationEstimate> second);

}  // namespace waymark

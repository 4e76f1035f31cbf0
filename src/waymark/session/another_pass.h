// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "waymark/camera/calibration.h"
#include "waymark/camera/camchain.h"
#include "waymark/session/session_options.h"

namespace waymark {

/// How far apart the pixels are, as a part of the image's width, where two calibrations of the same
/// rig have the same direction: root mean square over the image of the camera where it is most.
double image_shift(const Rig& before, const Rig& after);

/// The calibration to map a session's input once more with, from the start: that which the session
/// ended with, where the one it began with is another by so much that all that was tracked with it
/// suffers. Nothing if it is not, or where the input comes but once or at its own time.
std::optional<CameraChain> calibration_for_another_pass(const Session& session);

/// The changes of two passes, the second of which began where the first ended, as of one.
std::vector<CalibrationEstimate> join_passes(std::span<const CalibrationEstimate> first,
                                             std::vector<CalibrationEstimate> second);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/camera/camchain.h"
#include "waymark/mapping/focal_check.h"
#include "waymark/mapping/picture_motion.h"

namespace waymark {

// What usual mistakes in a calibration look like, each named in one line with its cure.

/// What is no likely camera, by its numbers alone; the chain is one that make_rig() takes.
std::vector<std::string> advise_on_numbers(const CameraChain& chain);

/// The time from one image to the next, in nanoseconds: whether its unit is a likely one.
std::optional<std::string> advise_on_times(double interval_ns);

/// What residuals say, be it good or bad.
std::string describe(const FocalCheck& check);
/// How what residuals say is put right; nothing where it is good. camera: number 0 as calibrated.
std::optional<std::string> advise_on_residuals(const FocalCheck& check,
                                               const CameraDescription& camera);

/// Of video that was stabilised; nothing where the pictures hold still.
std::optional<std::string> advise_on_pictures(const PictureMotion& motion);

}  // namespace waymark

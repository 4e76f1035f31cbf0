// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/camera/camchain.h"

namespace waymark {

// What usual mistakes in a calibration look like, each named in one line with its cure.

/// What is no likely camera, by its numbers alone; the chain is one that make_rig() takes.
std::vector<std::string> advise_on_numbers(const CameraChain& chain);

/// The time from one image to the next, in nanoseconds: whether its unit is a likely one.
std::optional<std::string> advise_on_times(double interval_ns);

}  // namespace waymark

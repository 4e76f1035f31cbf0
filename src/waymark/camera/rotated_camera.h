// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "waymark/camera/camchain.h"

namespace waymark {

/// The camera of images that are turned clockwise by so many quarters (0 to 3): about its axis, as
/// camN_from_cam0 is that of cameras that are all turned alike. Rows that are read out one after
/// the other are no rows any more where the quarters are odd: the readout is forgotten. Nothing for
/// models that are not ours, and for quarters of 360 degree images.
std::optional<ChainCamera> rotated(const ChainCamera& camera, int num_quarters);

}  // namespace waymark

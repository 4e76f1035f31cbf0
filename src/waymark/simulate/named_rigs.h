// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "waymark/camera/camchain.h"

namespace waymark {

/// Names that named_rig() knows: "surround", four cameras a quarter turn apart on a ring of 30 cm;
/// "car", six around one; "back_to_back", two fisheyes of 200 degrees whose centres are 3 cm apart;
/// "head", a pair 11 cm apart and one camera to either side.
std::vector<std::string> rig_names();

/// Cameras that look in several directions, camera 0 ahead, whose frame is that of the rig; images
/// have that height. Throws InputError for an unknown name.
CameraChain named_rig(std::string_view name, int height_px);

}  // namespace waymark

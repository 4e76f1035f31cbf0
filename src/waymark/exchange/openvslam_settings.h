// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/base/config.h"
#include "waymark/camera/camchain.h"

namespace waymark {

/// The cameras of a settings file of OpenVSLAM or stella_vslam (YAML), in sections or with the flat
/// keys of 2019 and 2020 (`Camera.fx`), as a camchain. A StereoRectifier gives the two cameras as
/// they are, before rectification, which is not needed here. Notes say what was passed over.
/// Throws InputError with its line for what is missing, malformed or has no counterpart.
CameraChain read_openvslam_settings(const ConfigSource& source);

}  // namespace waymark

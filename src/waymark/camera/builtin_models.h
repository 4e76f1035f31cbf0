// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/camera/registry.h"

namespace waymark {

/// Adds the models of this library under the names of Kalibr: pinhole (perspective, or fisheye with
/// equidistant distortion), omni, eucm, ds; and equirectangular and division.
void add_builtin_models(CameraRegistry& registry);

}  // namespace waymark

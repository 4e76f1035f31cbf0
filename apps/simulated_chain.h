// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "waymark/camera/camchain.h"
#include "waymark/input/input.h"

namespace waymark {

/// Of images of named cameras.
inline constexpr int kSimulatedHeightPx = 480;

/// The cameras of a simulated sequence. camera: a camchain file, or a name (named_cameras.h);
/// empty: the default one. Throws InputError for a file that describes too few cameras.
CameraChain simulated_chain(const std::string& camera, Setup setup);

/// Turns the second of a pair, where degrees are given, about its own axes. Throws InputError where
/// there is one camera.
void turn_camera1(const std::vector<double>& degrees, CameraChain& chain);

}  // namespace waymark

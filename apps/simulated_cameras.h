// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "waymark/camera/camchain.h"
#include "waymark/input/input.h"

namespace waymark {

/// The cameras of `waymark simulate` unless others are given: 640x480, moderately distorted; a pair
/// 11 cm apart that is neither parallel nor alike; depth in units of 0.2 mm.
CameraChain default_camera_chain(Setup setup);

/// The same of a named camera (simulate/named_cameras.h), 480 pixels high.
CameraChain named_camera_chain(const std::string& name, Setup setup);

/// The part of a camchain file that a setup uses. Throws InputError when it has too few cameras.
CameraChain read_camera_chain(const std::filesystem::path& file, Setup setup);

}  // namespace waymark

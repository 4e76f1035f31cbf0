// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>

#include "waymark/input/input.h"

namespace waymark {

/// Opens a camera, "camera:N" or a device such as /dev/video0, and reads its first frame. Asks for
/// images of the size that the calibration states. Throws InputError.
std::unique_ptr<Input> open_camera(const std::filesystem::path& path, const InputOptions& options);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>

#include "waymark/input/input.h"

namespace waymark {

/// Opens a video file. Times come from times.txt beside it (one per frame), else from the
/// container. Reads the first frame. Throws InputError.
std::unique_ptr<Input> open_video(const std::filesystem::path& path, const InputOptions& options);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

#include "waymark/input/listing.h"

namespace waymark {

/// Folder of images, or one that holds them in images/. Times come from times.txt in the folder or
/// beside it; without one the images are taken to be 1/30 s apart.
Listing list_image_folder(const std::filesystem::path& folder, const InputOptions& options);

}  // namespace waymark

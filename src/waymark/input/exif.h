// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "waymark/image/image_header.h"

namespace waymark {

/// The focal length, in pixels of images of this size, that the camera noted in a JPEG file, of
/// which the beginning will do (Exif 2.32, 4.6.5): from that of a film camera with the same field
/// of view over the diagonal, else from the length in mm and the resolution of the sensor. Right to
/// a few percent. Nothing where neither is there, where it is no likely number, or where the image
/// was cropped since.
std::optional<double> focal_px_in_exif(std::string_view jpeg, const ImageSize& size);

/// The same of a file.
std::optional<double> read_focal_px(const std::filesystem::path& path, const ImageSize& size);

}  // namespace waymark

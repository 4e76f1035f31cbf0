// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "waymark/exchange/export_scene.h"

namespace waymark {

/// The points of a scene in the Stanford polygon format (Turk 1994), binary, little-endian: x, y, z
/// as float, red, green, blue.
std::string format_ply(const ExportScene& scene);

/// Writes the file atomically; throws OutputError.
void write_ply(const std::filesystem::path& path, const ExportScene& scene);

}  // namespace waymark

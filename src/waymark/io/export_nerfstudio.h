// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "waymark/io/export_scene.h"

namespace waymark {

/// The views of a scene as the transforms.json of nerfstudio ("Data conventions" of its
/// documentation): cameras look along -z with y up, pixels are counted from the corner of the
/// image. image_folder and point_file are as the file names them, relative to itself. InputError
/// for a camera model that nerfstudio does not have.
std::string format_nerfstudio(const ExportScene& scene,
                              const std::string& image_folder,
                              const std::string& point_file);

/// Writes the file atomically; throws OutputError, and InputError like format_nerfstudio().
void write_nerfstudio(const std::filesystem::path& path,
                      const ExportScene& scene,
                      const std::string& image_folder,
                      const std::string& point_file);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "waymark/exchange/export_scene.h"

namespace waymark {

/// Both forms that COLMAP reads: .txt and .bin files.
enum class ColmapForm { kText, kBinary };

/// The three files of a COLMAP model, as its documentation describes them. Numbers of images,
/// cameras and points are our indices and ids plus one; pixels are counted from the corner of the
/// image, as COLMAP does.
struct ColmapModel {
  std::string cameras;  ///< Contents of cameras.txt or cameras.bin.
  std::string images;   ///< Contents of images.txt or images.bin: poses and pixels.
  std::string points;   ///< Contents of points3D.txt or points3D.bin.
};

/// InputError for a camera model that COLMAP does not have.
ColmapModel format_colmap(const ExportScene& scene, ColmapForm form);

/// Writes cameras, images and points3D (.txt or .bin) into the folder. Throws OutputError, and
/// InputError like format_colmap().
void write_colmap(const std::filesystem::path& folder, const ExportScene& scene, ColmapForm form);

/// What belongs to a transforms.json, as it names it: relative to itself.
struct NerfstudioPaths {
  std::string image_folder = "images";    ///< Holds the images of the views by name.
  std::string mask_folder = "masks";      ///< Holds the masks of the views by name.
  std::string point_file = "points.ply";  ///< The points, see format_ply().
};

/// The views of a scene as the transforms.json of nerfstudio ("Data conventions" of its
/// documentation): cameras look along -z with y up, pixels are counted from the corner of the
/// image. InputError for a camera model that nerfstudio does not have.
std::string format_nerfstudio(const ExportScene& scene, const NerfstudioPaths& paths);

/// The points of a scene in the Stanford polygon format (Turk 1994), binary, little-endian: x, y, z
/// as float, red, green, blue.
std::string format_ply(const ExportScene& scene);

/// Writes the file atomically; throws OutputError.
void write_ply(const std::filesystem::path& path, const ExportScene& scene);

}  // namespace waymark

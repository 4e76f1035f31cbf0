// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A map for other programs.
//
//   const ExportScene scene = make_export_scene(map, SubmapId{0});
//   write_ply("points.ply", scene);

#include <filesystem>
#include <string>

#include "waymark/exchange/export_scene.h"

namespace waymark {

/// Both forms that COLMAP reads: .txt and .bin files.
enum class ColmapFormat { kText, kBinary };

/// What the first image and camera of a scene are called: several scenes that share a database
/// have numbers of their own.
struct ColmapIds {
  std::uint32_t first_image = 1;   ///< Of the first view.
  std::uint32_t first_camera = 1;  ///< Of the first camera.
};

/// The three files of a COLMAP model, as its documentation describes them. Images and cameras are
/// numbered on from the first, points by the ids of landmarks plus one; pixels are counted from the
/// corner of the image, as COLMAP does.
struct ColmapModel {
  std::string cameras;  ///< Contents of cameras.txt or cameras.bin.
  std::string images;   ///< Contents of images.txt or images.bin: poses and pixels.
  std::string points;   ///< Contents of points3D.txt or points3D.bin.
};

/// A camera in COLMAP's words: the models of its documentation and their numbers.
struct ColmapCamera {
  std::int32_t model_id = 0;   ///< As in its binary files.
  const char* model = "";      ///< As in its text files.
  std::vector<double> params;  ///< Focal lengths, centre from the corner of the image, distortion.
};

/// InputError for a camera model that COLMAP does not have.
ColmapCamera colmap_camera(const CameraDescription& camera);

/// InputError like colmap_camera().
ColmapModel format_colmap(const ExportScene& scene, ColmapFormat form, ColmapIds numbers = {});

/// Writes cameras, images and points3D (.txt or .bin) into the folder. Throws OutputError, and
/// InputError like format_colmap().
void write_colmap(const std::filesystem::path& folder,
                  const ExportScene& scene,
                  ColmapFormat form,
                  ColmapIds numbers = {});

/// The cameras of a stereo rig for rig_bundle_adjuster, as the documentation of COLMAP 3.8 has it:
/// camera i took the images whose names begin with "camI/". Empty unless the views are those of one
/// rig of two cameras.
std::string format_colmap_rig(const ExportScene& scene, ColmapIds numbers = {});

/// What belongs to a transforms.json, as it names it: relative to itself.
struct NerfstudioPaths {
  std::string image_folder = "images";    ///< Holds the images of the views by name.
  std::string mask_folder = "masks";      ///< Holds the masks of the views by name.
  std::string point_file = "points.ply";  ///< The points, see format_ply().
};

/// The views of a scene as the transforms.json of nerfstudio ("Data conventions" of its
/// documentation): cameras look along -z with y up, pixels are counted from the corner of the
/// image. is_undistorted: no camera has distortion, and the file says so. InputError for a camera
/// model that nerfstudio does not have.
std::string format_nerfstudio(const ExportScene& scene,
                              const NerfstudioPaths& paths,
                              bool is_undistorted = false);

/// The points of a scene in the Stanford polygon format (Turk 1994), binary, little-endian: x, y, z
/// and the normal (nx, ny, nz) as float, red, green, blue.
std::string format_ply(const ExportScene& scene);

/// Writes the file atomically; throws OutputError.
void write_ply(const std::filesystem::path& path, const ExportScene& scene);

}  // namespace waymark

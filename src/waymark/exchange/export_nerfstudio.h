// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "waymark/exchange/export_scene.h"

namespace waymark {

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

}  // namespace waymark

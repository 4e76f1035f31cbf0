// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "waymark/io/export_scene.h"

namespace waymark {

/// What belongs to a transforms.json, as it names it: relative to itself.
struct NerfstudioPaths {
  std::string image_folder = "images";
  std::string mask_folder = "masks";
  std::string point_file = "points.ply";
};

/// The views of a scene as the transforms.json of nerfstudio ("Data conventions" of its
/// documentation): cameras look along -z with y up, pixels are counted from the corner of the
/// image. InputError for a camera model that nerfstudio does not have.
std::string format_nerfstudio(const ExportScene& scene, const NerfstudioPaths& paths);

}  // namespace waymark

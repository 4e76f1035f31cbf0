// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/named_cameras.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "waymark/base/check.h"

namespace waymark {
namespace {

/// A camera per unit of height.
struct Template {
  const char* name;
  const char* model;
  double aspect;                   ///< Width by height.
  std::vector<double> parameters;  ///< Before the focal length.
  double focal;                    ///< 0: the model has no intrinsics.
  const char* distortion_model;
  std::vector<double> distortion_coeffs;
};

const std::vector<Template>& templates() {
  static const std::vector<Template> all = {
      {"perspective", "pinhole", 4.0 / 3.0, {}, 0.9, "radtan", {-0.2, 0.05, 2e-4, -1e-4}},
      {"fisheye", "pinhole", 1.0, {}, 0.36, "equidistant", {3e-3, 7e-4, -2e-3, 2e-4}},
      // Folds at 106 degrees, where the circle touches the border.
      {"fisheye_200", "pinhole", 1.0, {}, 0.39, "equidistant", {-0.0925, 0.0, 0.0, 0.0}},
      {"equirectangular", "equirectangular", 2.0, {}, 0.0, "none", {}},
      {"omni", "omni", 1.0, {1.0}, 0.6, "radtan", {-0.02, 0.003, 2e-4, -1e-4}},
      {"eucm", "eucm", 1.0, {0.6, 1.05}, 0.35, "none", {}},
      {"ds", "ds", 1.0, {-0.2, 0.6}, 0.33, "none", {}},
      {"division", "division", 4.0 / 3.0, {}, 0.5, "none", {-0.25}},
  };
  return all;
}

}  // namespace

std::vector<std::string> camera_names() {
  std::vector<std::string> names;
  for (const Template& camera : templates()) names.push_back(camera.name);
  return names;
}

CameraDescription named_camera(std::string_view name, int height_px) {
  for (const Template& camera : templates()) {
    if (name != camera.name) continue;
    CameraDescription description;
    description.camera_model = camera.model;
    description.height_px = height_px;
    description.width_px = static_cast<int>(std::lround(camera.aspect * height_px));
    description.intrinsics = camera.parameters;
    if (camera.focal > 0.0) {
      const double focal_px = camera.focal * height_px;
      // Not quite square pixels, not quite centred.
      for (const double value : {focal_px,
                                 1.002 * focal_px,
                                 0.5 * description.width_px + 0.3,
                                 0.5 * description.height_px - 1.1}) {
        description.intrinsics.push_back(value);
      }
    }
    description.distortion_model = camera.distortion_model;
    description.distortion_coeffs = camera.distortion_coeffs;
    description.where = fmt::format("camera '{}'", name);
    return description;
  }
  throw InputError(fmt::format("camera '{}'", name),
                   fmt::format("is unknown, expected {}", fmt::join(camera_names(), ", ")));
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/exchange/exports.h"

namespace waymark {
namespace {

using Json = nlohmann::ordered_json;

[[noreturn]] void fail_model(const CameraDescription& camera) {
  throw InputError("export",
                   fmt::format("nerfstudio has no camera model {} with {} distortion coefficients, "
                               "expected pinhole with at most 5 (see --split-views)",
                               camera.camera_model,
                               camera.distortion_coeffs.size()));
}

/// What it says of a camera. Its OPENCV is k1 k2 p1 p2 with k3 as a third radial term.
Json intrinsics_of(const CameraDescription& camera) {
  const std::vector<double>& k = camera.distortion_coeffs;
  if (camera.camera_model != "pinhole" || k.size() > 5) fail_model(camera);
  Json json = {{"w", camera.width_px},
               {"h", camera.height_px},
               {"fl_x", camera.intrinsics[0]},
               {"fl_y", camera.intrinsics[1]},
               {"cx", camera.intrinsics[2] + 0.5},
               {"cy", camera.intrinsics[3] + 0.5}};
  const bool is_fisheye = camera.distortion_model == "equidistant";
  const std::array<const char*, 5> names = is_fisheye ? std::array{"k1", "k2", "k3", "k4", ""}
                                                      : std::array{"k1", "k2", "p1", "p2", "k3"};
  for (std::size_t i = 0; i < k.size(); ++i) json[names[i]] = k[i];
  return json;
}

const char* model_of(const ExportScene& scene) {
  const auto is_fisheye = [](const CameraDescription& camera) {
    return camera.distortion_model == "equidistant";
  };
  const bool first = !scene.cameras.empty() && is_fisheye(scene.cameras[0]);
  for (const CameraDescription& camera : scene.cameras) {
    if (is_fisheye(camera) == first) continue;
    throw InputError("export",
                     "cameras with and without fisheye lens in one transforms.json, expected one "
                     "kind (see --split-views)");
  }
  return first ? "OPENCV_FISHEYE" : "OPENCV";
}

/// Camera to world as a matrix, the camera being that of OpenGL.
Json transform_of(const ExportView& view) {
  Eigen::Matrix4d matrix = view.cam_from_world.inverse().matrix();
  matrix.col(1) = -matrix.col(1);
  matrix.col(2) = -matrix.col(2);
  matrix = matrix.unaryExpr(&unsigned_zero).eval();
  Json rows = Json::array();
  for (int row = 0; row < 4; ++row) {
    rows.push_back({matrix(row, 0), matrix(row, 1), matrix(row, 2), matrix(row, 3)});
  }
  return rows;
}

}  // namespace

std::string format_nerfstudio(const ExportScene& scene,
                              const NerfstudioPaths& paths,
                              bool is_undistorted) {
  Json json = {{"camera_model", is_undistorted ? "PINHOLE" : model_of(scene)}};
  const bool is_shared = scene.cameras.size() == 1;
  if (is_shared) json.update(intrinsics_of(scene.cameras[0]));
  json["ply_file_path"] = paths.point_file;
  json["frames"] = Json::array();
  for (const ExportView& view : scene.views) {
    Json frame = {{"file_path", paths.image_folder + "/" + view.name},
                  {"transform_matrix", transform_of(view)}};
    if (!view.mask_name.empty()) frame["mask_path"] = paths.mask_folder + "/" + view.mask_name;
    if (!is_shared) frame.update(intrinsics_of(scene.cameras[view.camera]));
    json["frames"].push_back(std::move(frame));
  }
  return json.dump(1) + "\n";
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/calibration_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/config_value.h"

namespace waymark {

const ConfigNode* find_any(const ConfigNode& map, const Keys& keys) {
  for (const std::string& key : keys) {
    const ConfigNode* node = map.kind == ConfigNode::Kind::kMap ? map.find(key) : nullptr;
    if (node != nullptr) return node;
  }
  return nullptr;
}

const ConfigNode& require_any(const ConfigNode& map, const std::string& file, const Keys& keys) {
  const ConfigNode* node = find_any(map, keys);
  if (node == nullptr) {
    throw InputError(file, fmt::format("has no {}, which is needed", keys.front()));
  }
  return *node;
}

std::vector<double> matrix_values(const ConfigNode& node, const std::string& key) {
  if (node.kind != ConfigNode::Kind::kMap) return config_doubles(node, key);
  const ConfigNode* data = node.find("data");
  if (data == nullptr) {
    throw InputError(node.where(), fmt::format("{} has no data, expected rows, cols, data", key));
  }
  return config_doubles(*data, key + ".data");
}

const Keys& matrix_keys() {
  static const Keys keys = {"camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "k"};
  return keys;
}

CameraDescription read_size_and_matrix(const ConfigNode& root,
                                       const std::string& file,
                                       const Keys& matrix) {
  CameraDescription camera;
  camera.camera_model = "pinhole";
  camera.where = file;
  const ConfigRange size{.low = 1, .high = 1e6};
  camera.width_px =
      config_int(require_any(root, file, {"image_width", "imageWidth", "image_Width", "width"}),
                 "image_width",
                 size);
  camera.height_px =
      config_int(require_any(root, file, {"image_height", "imageHeight", "image_Height", "height"}),
                 "image_height",
                 size);
  const ConfigNode& node = require_any(root, file, matrix);
  const std::vector<double> k = matrix_values(node, "camera_matrix");
  if (k.size() != 9) {
    throw InputError(node.where(),
                     fmt::format("camera_matrix has {} numbers, expected 3x3", k.size()));
  }
  const bool is_calibration =
      k[1] == 0.0 && k[3] == 0.0 && k[6] == 0.0 && k[7] == 0.0 && k[8] == 1.0;
  if (!is_calibration) {
    throw InputError(node.where(),
                     "camera_matrix is no [fu 0 pu; 0 fv pv; 0 0 1], expected one without skew");
  }
  camera.intrinsics = {k[0], k[4], k[2], k[5]};
  return camera;
}

void set_radial_tangential(CameraDescription& camera,
                           std::vector<double> coeffs,
                           const std::string& where) {
  const auto is_zero = [](double value) { return value == 0.0; };
  if (coeffs.size() > 8 && std::all_of(coeffs.begin() + 8, coeffs.end(), is_zero)) coeffs.resize(8);
  if (std::all_of(coeffs.begin(), coeffs.end(), is_zero)) return;
  if (coeffs.size() > 8) {
    throw InputError(where,
                     "distortion_coefficients has thin prism or tilt terms, expected at most 8 "
                     "numbers that are not 0");
  }
  camera.distortion_model = "radtan";
  camera.distortion_coeffs = std::move(coeffs);
}

void set_equidistant(CameraDescription& camera, std::vector<double> coeffs) {
  camera.distortion_model = "equidistant";
  camera.distortion_coeffs = std::move(coeffs);
}

CameraChain checked_chain(const CameraDescription& camera) {
  CameraChain chain;
  chain.cameras.push_back({camera, Rigid3()});
  make_rig(chain);  // Refuses what no model accepts.
  return chain;
}

}  // namespace waymark

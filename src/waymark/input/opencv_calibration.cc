// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/config_value.h"
#include "waymark/input/calibration_parts.h"
#include "waymark/input/foreign_calibration.h"
#include "waymark/input/xml_tree.h"

namespace waymark {
namespace {

struct OpencvKeys {
  Keys matrix;
  Keys distortion;
};

const OpencvKeys& keys_of_one() {
  static const OpencvKeys keys = {
      matrix_keys(),
      {"distortion_coefficients", "distCoeffs", "Distortion_Coefficients", "dist_coeffs", "D"}};
  return keys;
}

/// Of camera 0 and 1 of a pair, as the results of stereoCalibrate() are called.
const OpencvKeys& keys_of_pair(std::size_t camera) {
  static const std::array<OpencvKeys, 2> keys = {
      {{{"K1", "M1", "cameraMatrix1"}, {"D1", "distCoeffs1"}},
       {{"K2", "M2", "cameraMatrix2"}, {"D2", "distCoeffs2"}}}};
  return keys[camera];
}

CameraDescription read_opencv_camera(const ConfigNode& root,
                                     const std::string& file,
                                     const OpencvKeys& keys) {
  CameraDescription camera = read_size_and_matrix(root, file, keys.matrix);
  const ConfigNode* node = find_any(root, keys.distortion);
  std::vector<double> coeffs;
  if (node != nullptr) coeffs = matrix_values(*node, "distortion_coefficients");
  const ConfigNode* fisheye = find_any(root, {"fisheye_model"});
  if (fisheye != nullptr && config_int(*fisheye, "fisheye_model", {.low = 0, .high = 1}) == 1) {
    set_equidistant(camera, std::move(coeffs));
  } else {
    set_radial_tangential(camera, std::move(coeffs), node ? node->where() : file);
  }
  return camera;
}

std::vector<double> read_sized_matrix(const ConfigNode& root,
                                      const std::string& file,
                                      const std::string& key,
                                      std::size_t size) {
  const ConfigNode& node = require_any(root, file, {key});
  std::vector<double> values = matrix_values(node, key);
  if (values.size() == size) return values;
  throw InputError(node.where(),
                   fmt::format("{} has {} numbers, expected {}", key, values.size(), size));
}

CameraChain read_opencv_pair(const ConfigNode& root, const std::string& file) {
  if (find_any(root, {"image_width", "imageWidth", "image_Width"}) == nullptr) {
    throw InputError(file,
                     "is a stereo calibration of OpenCV without the size of its images, expected "
                     "image_width and image_height in it");
  }
  const std::vector<double> turn = read_sized_matrix(root, file, "R", 9);
  const std::vector<double> shift = read_sized_matrix(root, file, "T", 3);
  Eigen::Matrix4d cam1_from_cam0 = Eigen::Matrix4d::Identity();
  cam1_from_cam0.topLeftCorner<3, 3>() =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(turn.data());
  cam1_from_cam0.topRightCorner<3, 1>() = Eigen::Map<const Eigen::Vector3d>(shift.data());
  CameraChain chain;
  chain.cameras.push_back({read_opencv_camera(root, file, keys_of_pair(0)), Rigid3()});
  chain.cameras.push_back({read_opencv_camera(root, file, keys_of_pair(1)),
                           rigid_from_matrix(cam1_from_cam0, root.find("R")->where(), "R")});
  make_rig(chain);  // Refuses what no model accepts.
  return chain;
}

}  // namespace

ConfigSource without_opencv_header(ConfigSource source) {
  if (source.text.starts_with("%YAML:")) source.text.replace(0, 1, "#");
  return source;
}

bool is_opencv_calibration(const ConfigNode& root) {
  return find_any(root, matrix_keys()) != nullptr ||
         find_any(root, keys_of_pair(1).matrix) != nullptr;
}

CameraChain read_opencv_calibration(const ConfigSource& source) {
  const ConfigNode root =
      is_xml(source) ? parse_xml(source).second : parse_config(without_opencv_header(source));
  if (find_any(root, keys_of_pair(1).matrix) != nullptr) return read_opencv_pair(root, source.name);
  return checked_chain(read_opencv_camera(root, source.name, keys_of_one()));
}

}  // namespace waymark

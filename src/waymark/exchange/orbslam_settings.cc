// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/config_value.h"
#include "waymark/exchange/openvslam_camera.h"
#include "waymark/input/foreign_calibration.h"

namespace waymark {
namespace {

/// Keys with dots, all at the top.
class OrbslamKeys {
 public:
  explicit OrbslamKeys(const ConfigSource& source)
      : root_(parse_config(without_opencv_header(source))), file_(source.name) {}

  bool has(const std::string& key) const { return find(key) != nullptr; }
  const ConfigNode& require(const std::string& key) const {
    const ConfigNode* node = find(key);
    return node ? *node : throw InputError(file_, fmt::format("has no {}, which is needed", key));
  }
  std::string place_of(const std::string& key) const { return require(key).where(); }
  std::string text(const std::string& key) const { return config_string(require(key), key); }
  double number(const std::string& key) const { return config_double(require(key), key); }
  double number_or_zero(const std::string& key) const { return has(key) ? number(key) : 0.0; }
  int pixels(const std::string& key) const {
    return config_int(require(key), key, {.low = 1, .high = 1e6});
  }
  std::vector<double> matrix(const std::string& key, std::size_t size) const {
    const ConfigNode& node = require(key);
    const bool is_map = node.kind == ConfigNode::Kind::kMap;
    const ConfigNode* data = is_map ? node.find("data") : &node;
    if (data == nullptr) {
      throw InputError(node.where(), key + " has no data, expected rows, cols, dt, data");
    }
    std::vector<double> values = config_doubles(*data, key + ".data");
    if (values.size() == size) return values;
    throw InputError(node.where(),
                     fmt::format("{} has {} numbers, expected {}", key, values.size(), size));
  }
  const std::vector<std::string>& all() const { return root_.keys; }
  const std::string& file() const { return file_; }

 private:
  const ConfigNode* find(const std::string& key) const {
    return root_.kind == ConfigNode::Kind::kMap ? root_.find(key) : nullptr;
  }

  ConfigNode root_;
  std::string file_;
};

/// The camera whose keys begin with prefix. type: PinHole, KannalaBrandt8 or Rectified.
CameraDescription read_orbslam_camera(const OrbslamKeys& keys,
                                      const std::string& prefix,
                                      const std::string& type) {
  CameraDescription camera;
  camera.where = keys.place_of(prefix + ".fx");
  camera.camera_model = "pinhole";
  camera.width_px = keys.pixels("Camera.width");
  camera.height_px = keys.pixels("Camera.height");
  for (const char* key : {".fx", ".fy", ".cx", ".cy"}) {
    camera.intrinsics.push_back(keys.number(prefix + key));
  }
  if (type == "Rectified") return camera;
  const bool is_fisheye = type == "KannalaBrandt8";
  for (const char* key : is_fisheye ? std::vector{".k1", ".k2", ".k3", ".k4"}
                                    : std::vector{".k1", ".k2", ".p1", ".p2", ".k3"}) {
    camera.distortion_coeffs.push_back(keys.number_or_zero(prefix + key));
  }
  const bool is_ideal =
      std::ranges::all_of(camera.distortion_coeffs, [](double value) { return value == 0.0; });
  if (is_fisheye) {
    camera.distortion_model = "equidistant";
  } else if (is_ideal) {
    camera.distortion_coeffs.clear();
  } else {
    camera.distortion_model = "radtan";
  }
  return camera;
}

/// One of the cameras that older files rectify: K and D of LEFT or RIGHT.
CameraDescription read_side(const OrbslamKeys& keys, const std::string& side) {
  CameraDescription camera;
  camera.where = keys.place_of(side + ".K");
  camera.camera_model = "pinhole";
  camera.width_px = keys.pixels(side + ".width");
  camera.height_px = keys.pixels(side + ".height");
  const std::vector<double> k = keys.matrix(side + ".K", 9);
  camera.intrinsics = {k[0], k[4], k[2], k[5]};
  camera.distortion_model = "radtan";
  camera.distortion_coeffs = keys.matrix(side + ".D", 5);
  return camera;
}

Rigid3 rectifying_turn(const OrbslamKeys& keys, const std::string& key) {
  const std::vector<double> values = keys.matrix(key, 9);
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(values.data());
  return {rigid_from_matrix(matrix, keys.place_of(key), key).rotation, Eigen::Vector3d::Zero()};
}

/// A rectified pair, camera 1 being the same camera further to the right.
void add_rectified(CameraChain& chain, double baseline_m, const std::string& where) {
  if (!(baseline_m > 0.0)) {
    throw InputError(where,
                     fmt::format("gives a baseline of {} m, expected more than 0", baseline_m));
  }
  const Rigid3 cam1_from_cam0(Eigen::Quaterniond::Identity(), {-baseline_m, 0.0, 0.0});
  chain.cameras.push_back({chain.cameras[0].description, cam1_from_cam0});
}

CameraChain read_newer(const OrbslamKeys& keys) {
  const std::string type = keys.text("Camera.type");
  if (type != "PinHole" && type != "KannalaBrandt8" && type != "Rectified") {
    throw InputError(
        keys.place_of("Camera.type"),
        fmt::format("Camera.type is {}, expected PinHole, KannalaBrandt8 or Rectified", type));
  }
  CameraChain chain;
  chain.cameras.push_back({read_orbslam_camera(keys, "Camera1", type), Rigid3()});
  if (keys.has("Stereo.T_c1_c2") && keys.has("Camera2.fx")) {
    const std::string key = "Stereo.T_c1_c2";
    const std::vector<double> values = keys.matrix(key, 16);
    const Eigen::Matrix4d matrix =
        Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data());
    const Rigid3 cam0_from_cam1 = rigid_from_matrix(matrix, keys.place_of(key), key);
    chain.cameras.push_back({read_orbslam_camera(keys, "Camera2", type), cam0_from_cam1.inverse()});
  } else if (type == "Rectified" && !keys.has("RGBD.DepthMapFactor")) {
    add_rectified(chain, keys.number("Stereo.b"), keys.place_of("Stereo.b"));
  }
  return chain;
}

CameraChain read_older(const OrbslamKeys& keys) {
  const bool has_type = keys.has("Camera.type");
  CameraChain chain;
  const std::string type = has_type ? keys.text("Camera.type") : "PinHole";
  chain.cameras.push_back({read_orbslam_camera(keys, "Camera", type), Rigid3()});
  if (keys.has("DepthMapFactor") || !keys.has("Camera.bf")) return chain;
  const std::string where = keys.place_of("Camera.bf");
  add_rectified(chain, keys.number("Camera.bf") / keys.number("Camera.fx"), where);
  if (!keys.has("LEFT.K")) return chain;
  // Back from the rectified pair to the cameras that took the images.
  chain.cameras[1].cam_from_rig = rectifying_turn(keys, "RIGHT.R").inverse() *
                                  chain.cameras[1].cam_from_rig * rectifying_turn(keys, "LEFT.R");
  chain.cameras[0].description = read_side(keys, "LEFT");
  chain.cameras[1].description = read_side(keys, "RIGHT");
  return chain;
}

/// What the rest of the file is about.
void note_passed_over(const OrbslamKeys& keys, CameraChain& chain) {
  std::vector<std::string> sections;
  for (const std::string& key : keys.all()) {
    const std::string section = key.substr(0, key.find('.'));
    constexpr std::array kUsed = {"Camera",
                                  "Camera1",
                                  "Camera2",
                                  "Stereo",
                                  "LEFT",
                                  "RIGHT",
                                  "RGBD",
                                  "File",
                                  "DepthMapFactor"};
    if (std::ranges::find(kUsed, section) != kUsed.end()) continue;
    if (std::ranges::find(sections, section) == sections.end()) sections.push_back(section);
  }
  if (sections.empty()) return;
  chain.notes.push_back(fmt::format("{}: settings of another program's algorithms are ignored: {}",
                                    keys.file(),
                                    fmt::join(sections, ", ")));
}

}  // namespace

CameraChain read_orbslam_settings(const ConfigSource& source) {
  const OrbslamKeys keys(source);
  CameraChain chain = keys.has("Camera1.fx") ? read_newer(keys) : read_older(keys);
  for (const char* key : {"RGBD.DepthMapFactor", "DepthMapFactor"}) {
    if (!keys.has(key)) continue;
    chain.depth_factor = config_double(keys.require(key), key, {.low = 1e-3, .high = 1e9});
  }
  make_rig(chain);  // Refuses what no model accepts.
  note_passed_over(keys, chain);
  return chain;
}

}  // namespace waymark

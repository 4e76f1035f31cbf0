// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/config_value.h"
#include "waymark/exchange/openvslam_camera.h"
#include "waymark/exchange/openvslam_records.h"
#include "waymark/input/foreign_calibration.h"

namespace waymark {
namespace {

/// A section of the file, whichever way its keys are written.
class Section {
 public:
  Section(const ConfigNode& root, std::string file, std::string name)
      : root_(root), file_(std::move(file)), name_(std::move(name)) {}

  const ConfigNode* find(const std::string& key) const {
    const ConfigNode* section = root_.kind == ConfigNode::Kind::kMap ? root_.find(name_) : nullptr;
    if (section != nullptr && section->kind == ConfigNode::Kind::kMap) return section->find(key);
    return root_.kind == ConfigNode::Kind::kMap ? root_.find(key_of(key)) : nullptr;
  }
  const ConfigNode& require(const std::string& key) const {
    const ConfigNode* node = find(key);
    if (node != nullptr) return *node;
    throw InputError(file_, fmt::format("has no {}, which is needed", key_of(key)));
  }
  std::string text(const std::string& key) const {
    return config_string(require(key), key_of(key));
  }
  std::vector<double> numbers(const std::string& key) const {
    return config_doubles(require(key), key_of(key));
  }
  std::string key_of(const std::string& key) const { return name_ + "." + key; }

 private:
  const ConfigNode& root_;
  std::string file_;
  std::string name_;
};

OpenvslamCamera read_camera(const Section& section, const std::string& file) {
  OpenvslamCamera camera;
  const ConfigNode& model = section.require("model");
  camera.where = model.where().empty() ? file : model.where() + ": Camera";
  camera.model = section.text("model");
  camera.setup = section.text("setup");
  if (const ConfigNode* name = section.find("name")) {
    camera.name = config_string(*name, section.key_of("name"));
  }
  for (const char* key : {"cols",
                          "rows",
                          "fx",
                          "fy",
                          "cx",
                          "cy",
                          "k1",
                          "k2",
                          "k3",
                          "k4",
                          "p1",
                          "p2",
                          "distortion",
                          "focal_x_baseline"}) {
    const ConfigNode* node = section.find(key);
    if (node != nullptr) camera.numbers[key] = config_double(*node, section.key_of(key));
  }
  return camera;
}

/// One of the cameras before rectification: K and D of a side.
CameraDescription unrectified_camera(const Section& rectifier,
                                     const std::string& side,
                                     bool is_fisheye,
                                     CameraDescription description) {
  const std::string key = "K_" + side;
  const std::vector<double> k = rectifier.numbers(key);
  description.where = rectifier.require(key).where() + ": " + rectifier.key_of(key);
  if (k.size() != 9) description.fail(fmt::format("has {} numbers, expected 3x3", k.size()));
  if (k[1] != 0.0 || k[3] != 0.0 || k[6] != 0.0 || k[7] != 0.0 || k[8] != 1.0) {
    description.fail("is no [fx 0 cx; 0 fy cy; 0 0 1], expected one without skew");
  }
  description.intrinsics = {k[0], k[4], k[2], k[5]};
  description.distortion_model = is_fisheye ? "equidistant" : "radtan";
  description.distortion_coeffs = rectifier.numbers("D_" + side);
  return description;
}

Eigen::Quaterniond rectifying_rotation(const Section& rectifier, const std::string& key) {
  const std::vector<double> r = rectifier.numbers(key);
  const std::string where = rectifier.require(key).where();
  if (r.size() != 9) {
    throw InputError(
        where, fmt::format("{} has {} numbers, expected 3x3", rectifier.key_of(key), r.size()));
  }
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r.data());
  return rigid_from_matrix(matrix, where, rectifier.key_of(key)).rotation;
}

/// From the rectified pair back to the cameras that took the images.
void undo_rectification(const Section& rectifier, CameraChain& chain) {
  const ConfigNode* node = rectifier.find("model");
  const std::string model =
      node == nullptr ? "perspective" : config_string(*node, rectifier.key_of("model"));
  const bool is_fisheye = normalized_name(model) == "fisheye";
  if (!is_fisheye && normalized_name(model) != "perspective") {
    throw InputError(node->where(),
                     fmt::format("StereoRectifier.model is {}, expected perspective or fisheye",
                                 describe_value(*node)));
  }
  const Rigid3 right_from_left(rectifying_rotation(rectifier, "R_left"), Eigen::Vector3d::Zero());
  const Rigid3 rectified_right(rectifying_rotation(rectifier, "R_right"), Eigen::Vector3d::Zero());
  chain.cameras[1].cam_from_rig =
      rectified_right.inverse() * chain.cameras[1].cam_from_rig * right_from_left;
  chain.cameras[0].description =
      unrectified_camera(rectifier, "left", is_fisheye, chain.cameras[0].description);
  chain.cameras[1].description =
      unrectified_camera(rectifier, "right", is_fisheye, chain.cameras[1].description);
}

/// The sections, whichever way they are written, that say nothing about cameras.
void note_ignored(const ConfigNode& root, const std::string& file, CameraChain& chain) {
  std::vector<std::string> ignored;
  for (const std::string& key : root.keys) {
    const std::string section = key.substr(0, key.find('.'));
    if (section == "Camera" || section == "StereoRectifier" || section == "depthmap_factor") {
      continue;
    }
    if (std::find(ignored.begin(), ignored.end(), section) == ignored.end()) {
      ignored.push_back(section);
    }
  }
  if (ignored.empty()) return;
  chain.notes.push_back(fmt::format("{}: settings of another program's algorithms are ignored: {}",
                                    file,
                                    fmt::join(ignored, ", ")));
}

}  // namespace

CameraChain read_openvslam_settings(const ConfigSource& source) {
  const ConfigNode root = parse_config(without_opencv_header(source));
  const OpenvslamCamera camera = read_camera(Section(root, source.name, "Camera"), source.name);
  CameraChain chain = openvslam_camchain(camera);
  const Section rectifier(root, source.name, "StereoRectifier");
  if (chain.cameras.size() == 2 && rectifier.find("K_left") != nullptr) {
    undo_rectification(rectifier, chain);
    make_rig(chain);  // Refuses what no model accepts.
  }
  const ConfigNode* factor = Section(root, source.name, "Preprocessing").find("depthmap_factor");
  if (factor == nullptr && root.kind == ConfigNode::Kind::kMap) {
    factor = root.find("depthmap_factor");
  }
  if (factor != nullptr) {
    chain.depth_factor = config_double(*factor, "depthmap_factor", {.low = 1e-3, .high = 1e9});
  }
  note_ignored(root, source.name, chain);
  return chain;
}

OpenvslamPyramid read_openvslam_pyramid(const ConfigSource& settings) {
  const ConfigNode root = parse_config(without_opencv_header(settings));
  const Section feature(root, settings.name, "Feature");
  OpenvslamPyramid pyramid;
  if (const ConfigNode* factor = feature.find("scale_factor")) {
    pyramid.scale_factor =
        config_double(*factor, "Feature.scale_factor", {.low = 1.01, .high = 10});
  }
  if (const ConfigNode* levels = feature.find("num_levels")) {
    pyramid.num_levels = config_int(*levels, "Feature.num_levels", {.low = 1, .high = 64});
  }
  return pyramid;
}

}  // namespace waymark

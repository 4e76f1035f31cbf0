// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Calibrations in which each number has a name: a table says which of ours it is.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/config_value.h"
#include "waymark/base/text.h"
#include "waymark/input/calibration_parts.h"
#include "waymark/input/foreign_calibration.h"

namespace waymark {
namespace {

/// A camera model of another program in terms of ours: the names of our numbers, in our order.
/// Those that begin with '?' are 0 where they are missing.
struct NamedModel {
  std::string_view name;
  const char* camera_model;
  std::vector<std::string> intrinsics;
  const char* distortion_model;
  std::vector<std::string> distortion;
};

using NamedModels = std::vector<NamedModel>;

const NamedModel& find_named_model(const NamedModels& models,
                                   const ConfigNode& node,
                                   const char* key) {
  const std::string name = config_string(node, key);
  std::string known;
  for (const NamedModel& model : models) {
    if (model.name == name) return model;
    known += (known.empty() ? "" : ", ") + std::string(model.name);
  }
  throw InputError(
      node.where(),
      fmt::format("{} is {}, expected one of: {}", key, quote_for_message(name), known));
}

/// The numbers of a camera, wherever in these sections they are.
double number_in(std::span<const ConfigNode* const> sections,
                 const std::string& file,
                 std::string_view key) {
  const bool may_miss = key.starts_with("?");
  if (may_miss) key.remove_prefix(1);
  for (const ConfigNode* section : sections) {
    const ConfigNode* node = find_any(*section, {std::string(key)});
    if (node != nullptr) return config_double(*node, key);
  }
  if (may_miss) return 0.0;
  throw InputError(file, fmt::format("has no {}, which is needed", key));
}

int pixels_in(const ConfigNode& map, const std::string& file, const char* key) {
  return config_int(require_any(map, file, {key}), key, {.low = 1, .high = 1e6});
}

/// Without its size.
CameraDescription read_named(const NamedModel& model,
                             std::span<const ConfigNode* const> sections,
                             const std::string& file) {
  CameraDescription camera;
  camera.where = file;
  camera.camera_model = model.camera_model;
  for (const auto& key : model.intrinsics) {
    camera.intrinsics.push_back(number_in(sections, file, key));
  }
  std::vector<double> coeffs;
  for (const auto& key : model.distortion) coeffs.push_back(number_in(sections, file, key));
  if (std::string_view(model.distortion_model) == "radtan") {
    set_radial_tangential(camera, std::move(coeffs), file);
  } else {
    camera.distortion_model = model.distortion_model;
    camera.distortion_coeffs = std::move(coeffs);
  }
  return camera;
}

const std::vector<ConfigNode>& items_of(const ConfigNode& map,
                                        const std::string& file,
                                        const char* key) {
  const ConfigNode& node = require_any(map, file, {key});
  if (node.kind == ConfigNode::Kind::kList) return node.items;
  throw InputError(node.where(), fmt::format("{} is no list, expected one", key));
}

Rigid3 read_basalt_pose(const ConfigNode& node, const std::string& file) {
  const auto number = [&](const char* key) {
    const ConfigNode* const section = &node;
    return number_in({&section, 1}, file, key);
  };
  const Eigen::Quaterniond turn(number("qw"), number("qx"), number("qy"), number("qz"));
  if (std::abs(turn.norm() - 1.0) > 1e-3) {
    throw InputError(node.where(), "T_imu_cam has no unit quaternion, expected qx qy qz qw of one");
  }
  return {turn.normalized(), {number("px"), number("py"), number("pz")}};
}

/// Basalt's calibration.json, of its first two cameras (basalt-headers, camera models).
CameraChain read_basalt(const ConfigNode& root, const std::string& file) {
  static const NamedModels models = {
      {"kb4", "pinhole", {"fx", "fy", "cx", "cy"}, "equidistant", {"k1", "k2", "k3", "k4"}},
      {"pinhole", "pinhole", {"fx", "fy", "cx", "cy"}, "none", {}},
      {"pinhole-radtan8",
       "pinhole",
       {"fx", "fy", "cx", "cy"},
       "radtan",
       {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"}},
      {"ds", "ds", {"xi", "alpha", "fx", "fy", "cx", "cy"}, "none", {}},
      {"eucm", "eucm", {"alpha", "beta", "fx", "fy", "cx", "cy"}, "none", {}}};
  const ConfigNode& value = *root.find("value0");
  const auto& cameras = items_of(value, file, "intrinsics");
  const auto& poses = items_of(value, file, "T_imu_cam");
  const auto& sizes = items_of(value, file, "resolution");
  if (cameras.empty() || cameras.size() != poses.size() || cameras.size() != sizes.size()) {
    throw InputError(file,
                     "has not as many intrinsics as T_imu_cam and resolution, expected one each");
  }
  CameraChain chain;
  for (std::size_t i = 0; i < std::min<std::size_t>(cameras.size(), 2); ++i) {
    const NamedModel& model =
        find_named_model(models, require_any(cameras[i], file, {"camera_type"}), "camera_type");
    const ConfigNode* const numbers = &require_any(cameras[i], file, {"intrinsics"});
    CameraDescription camera = read_named(model, {&numbers, 1}, file);
    const std::vector<double> size =
        config_doubles(sizes[i], "resolution", {.low = 1, .high = 1e6});
    if (size.size() != 2) {
      throw InputError(sizes[i].where(), "resolution has not 2 numbers, expected width and height");
    }
    camera.width_px = static_cast<int>(size[0]);
    camera.height_px = static_cast<int>(size[1]);
    chain.cameras.push_back(
        {camera, read_basalt_pose(poses[i], file).inverse() * read_basalt_pose(poses[0], file)});
  }
  chain.cameras[0].cam_from_rig = Rigid3();
  if (cameras.size() > 2) {
    chain.notes.push_back(
        fmt::format("{}: the first two of {} cameras are taken", file, cameras.size()));
  }
  return chain;
}

CameraChain chain_of_size(CameraDescription camera,
                          const ConfigNode& map,
                          const std::string& file,
                          const char* width,
                          const char* height) {
  camera.width_px = pixels_in(map, file, width);
  camera.height_px = pixels_in(map, file, height);
  return {{{std::move(camera), Rigid3()}}, {}, {}};
}

/// VINS and camodocal: model_type; their MEI is the unified model of Mei and Rives.
CameraChain read_camodocal(const ConfigNode& root, const std::string& file) {
  static const NamedModels models = {
      {"PINHOLE", "pinhole", {"fx", "fy", "cx", "cy"}, "radtan", {"k1", "k2", "p1", "p2"}},
      {"KANNALA_BRANDT",
       "pinhole",
       {"mu", "mv", "u0", "v0"},
       "equidistant",
       {"k2", "k3", "k4", "k5"}},
      {"MEI", "omni", {"xi", "gamma1", "gamma2", "u0", "v0"}, "radtan", {"k1", "k2", "p1", "p2"}}};
  const NamedModel& model = find_named_model(models, *root.find("model_type"), "model_type");
  std::vector<const ConfigNode*> sections;
  for (const char* key : {"projection_parameters", "distortion_parameters", "mirror_parameters"}) {
    if (const ConfigNode* section = root.find(key)) sections.push_back(section);
  }
  return chain_of_size(
      read_named(model, sections, file), root, file, "image_width", "image_height");
}

/// OpenImuCameraCalibrator; its vertical focal length is given by the aspect ratio.
CameraChain read_openicc(const ConfigNode& root, const std::string& file) {
  const std::vector<std::string> plane = {
      "focal_length", "focal_length", "principal_pt_x", "principal_pt_y"};
  const std::string radial = "radial_distortion_", tangential = "tangential_distortion_";
  const NamedModels models = {
      {"PINHOLE", "pinhole", plane, "radtan", {radial + "1", radial + "2", "?", "?"}},
      {"PINHOLE_RADIAL_TANGENTIAL",
       "pinhole",
       plane,
       "radtan",
       {radial + "1", radial + "2", tangential + "1", tangential + "2", radial + "3"}},
      {"FISHEYE",
       "pinhole",
       plane,
       "equidistant",
       {radial + "1", radial + "2", radial + "3", radial + "4"}}};
  const NamedModel& model =
      find_named_model(models, *root.find("intrinsic_type"), "intrinsic_type");
  const ConfigNode* const numbers = &require_any(root, file, {"intrinsics"});
  CameraDescription camera = read_named(model, {&numbers, 1}, file);
  camera.intrinsics[1] *= number_in({&numbers, 1}, file, "aspect_ratio");
  if (number_in({&numbers, 1}, file, "?skew") != 0.0) {
    throw InputError(numbers->where(), "has skew, expected pixels without");
  }
  return chain_of_size(std::move(camera), root, file, "image_width", "image_height");
}

/// OpenSfM and ODM: the first camera of camera_models.json, cameras.json. Lengths are parts of the
/// larger side, counted from the centre of the image (OpenSfM, "Geometric Models").
CameraChain read_opensfm(const ConfigNode& root, const std::string& file) {
  const std::vector<std::string> one = {"focal", "focal", "?", "?"};
  const std::vector<std::string> two = {"focal_x", "focal_y", "c_x", "c_y"};
  const NamedModels models = {
      {"perspective", "pinhole", one, "radtan", {"k1", "k2", "?", "?"}},
      {"simple_radial", "pinhole", two, "radtan", {"k1", "?", "?", "?"}},
      {"radial", "pinhole", two, "radtan", {"k1", "k2", "?", "?"}},
      {"brown", "pinhole", two, "radtan", {"k1", "k2", "p1", "p2", "k3"}},
      {"fisheye", "pinhole", one, "equidistant", {"k1", "k2", "?", "?"}},
      {"fisheye_opencv", "pinhole", two, "equidistant", {"k1", "k2", "k3", "k4"}},
      {"spherical", "equirectangular", {}, "none", {}},
      {"equirectangular", "equirectangular", {}, "none", {}}};
  const ConfigNode* const first = &root.items.front();
  const NamedModel& model =
      find_named_model(models, *first->find("projection_type"), "projection_type");
  CameraChain chain =
      chain_of_size(read_named(model, {&first, 1}, file), *first, file, "width", "height");
  CameraDescription& camera = chain.cameras[0].description;
  const double scale = std::max(camera.width_px, camera.height_px);
  for (double& number : camera.intrinsics) number *= scale;
  if (!camera.intrinsics.empty()) {
    camera.intrinsics[2] += 0.5 * (camera.width_px - 1);
    camera.intrinsics[3] += 0.5 * (camera.height_px - 1);
  }
  if (root.items.size() > 1) {
    chain.notes.push_back(
        fmt::format("{}: the first of {} cameras is taken", file, root.items.size()));
  }
  return chain;
}

/// Metashape's calibration as XML (its manual, "Camera models"): the centre counts from that of the
/// image, pixels from their corners, and p1 and p2 are the other way round.
CameraChain read_metashape(const ConfigNode& root, const std::string& file) {
  const std::vector<std::string> plane = {"f", "f", "?cx", "?cy"};
  const NamedModels models = {
      {"frame", "pinhole", plane, "radtan", {"?k1", "?k2", "?p2", "?p1", "?k3"}},
      {"fisheye", "pinhole", plane, "equidistant", {"?k1", "?k2", "?k3", "?k4"}}};
  const NamedModel& model =
      find_named_model(models, require_any(root, file, {"projection"}), "projection");
  const ConfigNode* const numbers = &root;
  const bool is_frame = model.name == "frame";
  for (const char* key : {"?b2", is_frame ? "?k4" : "?p1", is_frame ? "?p3" : "?p2"}) {
    if (number_in({&numbers, 1}, file, key) == 0.0) continue;
    throw InputError(file, fmt::format("has {}, which has no counterpart, expected 0", key + 1));
  }
  CameraChain chain =
      chain_of_size(read_named(model, {&numbers, 1}, file), root, file, "width", "height");
  CameraDescription& camera = chain.cameras[0].description;
  camera.intrinsics[0] += number_in({&numbers, 1}, file, "?b1");
  camera.intrinsics[2] += 0.5 * camera.width_px - 0.5;
  camera.intrinsics[3] += 0.5 * camera.height_px - 0.5;
  return chain;
}

bool is_opensfm(const ConfigNode& root) {
  return !root.items.empty() && find_any(root.items.front(), {"projection_type"}) != nullptr;
}

}  // namespace

std::optional<CameraChain> read_named_calibration(const ConfigNode& root, const std::string& file) {
  CameraChain (*read)(const ConfigNode&, const std::string&) = nullptr;
  if (root.find("value0") != nullptr && find_any(*root.find("value0"), {"intrinsics"}) != nullptr) {
    read = read_basalt;
  } else if (root.find("model_type") != nullptr) {
    read = read_camodocal;
  } else if (root.find("intrinsic_type") != nullptr) {
    read = read_openicc;
  } else if (is_opensfm(root)) {
    read = read_opensfm;
  } else if (root.find("projection") != nullptr) {
    read = read_metashape;
  }
  if (read == nullptr) return std::nullopt;
  CameraChain chain = read(root, file);
  make_rig(chain);  // Refuses what no model accepts.
  return chain;
}

}  // namespace waymark

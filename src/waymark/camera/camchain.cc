// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/camchain.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cctype>
#include <cmath>

#include "waymark/base/check.h"
#include "waymark/base/config_value.h"

namespace waymark {
namespace {

constexpr double kMaxRotationError = 1e-3;
constexpr double kMaxLastRowError = 1e-9;
constexpr std::size_t kMaxCameras = 16;
constexpr std::size_t kMaxUsedCameras = 2;  // Of a stereo pair.

bool is_camera_key(std::string_view key) {
  return key.size() > 3 && key.starts_with("cam") &&
         std::all_of(key.begin() + 3, key.end(), [](unsigned char c) { return std::isdigit(c); });
}

bool is_ignored_key(std::string_view key) {
  return key == "rostopic" || key == "cam_overlaps" || key == "T_cam_imu" ||
         key == "timeshift_cam_imu";
}

void check_keys(const ConfigNode& camera, const std::string& name, CameraChain& chain) {
  const std::vector<std::string> known = {name + ".camera_model",
                                          name + ".intrinsics",
                                          name + ".distortion_model",
                                          name + ".distortion_coeffs",
                                          name + ".resolution",
                                          name + ".T_cn_cnm1",
                                          name + ".readout_ms"};
  for (std::size_t i = 0; i < camera.items.size(); ++i) {
    const std::string key = name + "." + camera.keys[i];
    if (is_ignored_key(camera.keys[i])) {
      chain.notes.push_back(fmt::format("{}: {} is ignored", camera.items[i].where(), key));
    } else if (std::find(known.begin(), known.end(), key) == known.end()) {
      fail_unknown_key(camera.items[i], key, known);
    }
  }
}

const ConfigNode& require(const ConfigNode& camera, const std::string& name, const char* key) {
  const ConfigNode* node = camera.find(key);
  if (node == nullptr) {
    throw InputError(camera.where(), fmt::format("{} has no {}, which is needed", name, key));
  }
  return *node;
}

CameraDescription read_description(const ConfigNode& camera, const std::string& name) {
  CameraDescription description;
  description.where = fmt::format("{}: {}", camera.where(), name);
  description.camera_model =
      config_string(require(camera, name, "camera_model"), name + ".camera_model");
  if (const ConfigNode* node = camera.find("intrinsics")) {
    description.intrinsics = config_doubles(*node, name + ".intrinsics");
  }
  if (const ConfigNode* node = camera.find("distortion_model")) {
    description.distortion_model = config_string(*node, name + ".distortion_model");
    if (description.distortion_model == "fov") {
      throw InputError(node->where(),
                       fmt::format("{}.distortion_model is fov, which is not supported, expected "
                                   "a calibration with radtan, equidistant or none",
                                   name));
    }
  }
  if (const ConfigNode* node = camera.find("distortion_coeffs")) {
    description.distortion_coeffs = config_doubles(*node, name + ".distortion_coeffs");
  }
  const ConfigNode& resolution = require(camera, name, "resolution");
  if (resolution.kind != ConfigNode::Kind::kList || resolution.items.size() != 2) {
    throw InputError(resolution.where(),
                     fmt::format("{}.resolution is {}, expected [width, height] in pixels",
                                 name,
                                 describe_value(resolution)));
  }
  description.width_px = config_int(resolution.items[0], name + ".resolution[0]", {.low = 1});
  description.height_px = config_int(resolution.items[1], name + ".resolution[1]", {.low = 1});
  return description;
}

Rigid3 read_transform(const ConfigNode& node, const std::string& key) {
  const auto fail_shape = [&] {
    throw InputError(
        node.where(),
        fmt::format("{} is {}, expected 4 rows of 4 numbers", key, describe_value(node)));
  };
  if (node.kind != ConfigNode::Kind::kList || node.items.size() != 4) fail_shape();
  Eigen::Matrix4d matrix;
  for (int row = 0; row < 4; ++row) {
    const std::vector<double> values =
        config_doubles(node.items[static_cast<std::size_t>(row)], fmt::format("{}[{}]", key, row));
    if (values.size() != 4) fail_shape();
    matrix.row(row) = Eigen::Map<const Eigen::RowVector4d>(values.data());
  }
  return rigid_from_matrix(matrix, node.where(), key);
}

Rigid3 read_cam_from_rig(const ConfigNode& camera, const std::string& name, CameraChain& chain) {
  const ConfigNode* node = camera.find("T_cn_cnm1");
  if (chain.cameras.empty()) {
    if (node == nullptr) return Rigid3();
    throw InputError(node->where(),
                     fmt::format("{}.T_cn_cnm1 is given, expected none, for camera 0 is the origin "
                                 "of the rig",
                                 name));
  }
  const Rigid3 cam_from_previous =
      read_transform(require(camera, name, "T_cn_cnm1"), name + ".T_cn_cnm1");
  return cam_from_previous * chain.cameras.back().cam_from_rig;
}

/// Every cam... key must be one of cam0 to the last of those read.
void check_numbering(const ConfigNode& config, std::size_t num_cameras) {
  for (std::size_t i = 0; i < config.items.size(); ++i) {
    const std::string& key = config.keys[i];
    if (!is_camera_key(key)) continue;
    bool is_read = false;
    for (std::size_t n = 0; n < num_cameras; ++n) is_read |= key == fmt::format("cam{}", n);
    if (!is_read) {
      throw InputError(config.items[i].where(),
                       fmt::format("{} is given without cam{}, expected cam0, cam1, ... without "
                                   "gaps and at most {}",
                                   key,
                                   num_cameras,
                                   kMaxCameras));
    }
  }
}

}  // namespace

std::optional<CameraChain> read_camchain(const ConfigNode& config) {
  CameraChain chain;
  while (chain.cameras.size() < kMaxCameras) {
    const std::string name = fmt::format("cam{}", chain.cameras.size());
    const ConfigNode* camera = config.find(name);
    if (camera == nullptr) break;
    if (camera->kind != ConfigNode::Kind::kMap) {
      throw InputError(
          camera->where(),
          fmt::format("{} is {}, expected a section of KEY: VALUE", name, describe_value(*camera)));
    }
    check_keys(*camera, name, chain);
    if (chain.cameras.size() >= kMaxUsedCameras) {
      chain.notes.push_back(
          fmt::format("{}: {} is ignored, cam0 and cam1 at most are used", camera->where(), name));
    }
    const CameraDescription description = read_description(*camera, name);
    chain.cameras.push_back({description, read_cam_from_rig(*camera, name, chain)});
    if (const ConfigNode* readout = camera->find("readout_ms")) {
      const double readout_ms =
          config_double(*readout, name + ".readout_ms", {.low = -1e3, .high = 1e3});
      chain.cameras.back().readout_s = 1e-3 * readout_ms;
    }
  }
  check_numbering(config, chain.cameras.size());
  if (chain.cameras.empty()) return std::nullopt;
  const ConfigNode* depth = config.find("depth");
  const ConfigNode* factor = depth == nullptr ? nullptr : depth->find("factor");
  if (factor != nullptr) {
    chain.depth_factor = config_double(*factor, "depth.factor", {.low = 1e-3, .high = 1e9});
  }
  return chain;
}

std::string format_camchain(const CameraChain& chain) {
  std::string text;
  for (std::size_t i = 0; i < chain.cameras.size(); ++i) {
    const CameraDescription& camera = chain.cameras[i].description;
    text += fmt::format("cam{}:\n  camera_model: {}\n", i, camera.camera_model);
    if (!camera.intrinsics.empty()) {
      text += fmt::format("  intrinsics: [{}]\n", fmt::join(camera.intrinsics, ", "));
    }
    text += fmt::format("  distortion_model: {}\n", camera.distortion_model);
    if (!camera.distortion_coeffs.empty()) {
      text += fmt::format("  distortion_coeffs: [{}]\n", fmt::join(camera.distortion_coeffs, ", "));
    }
    text += fmt::format("  resolution: [{}, {}]\n", camera.width_px, camera.height_px);
    const double readout_s = chain.cameras[i].readout_s;
    if (readout_s != 0.0) text += fmt::format("  readout_ms: {:.6g}\n", 1e3 * readout_s);
    if (i == 0) continue;
    const Eigen::Matrix4d from_previous =
        (chain.cameras[i].cam_from_rig * chain.cameras[i - 1].cam_from_rig.inverse()).matrix();
    text += "  T_cn_cnm1:\n";
    for (int row = 0; row < 4; ++row) {
      text += fmt::format("  - [{}]\n", fmt::join(from_previous.row(row), ", "));
    }
  }
  if (chain.depth_factor) text += fmt::format("depth: {{factor: {}}}\n", *chain.depth_factor);
  return text;
}

Rig make_rig(const CameraChain& chain, const CameraRegistry& registry) {
  WAYMARK_CHECK(!chain.cameras.empty());
  Rig rig;
  const auto models = std::make_shared<const CameraRegistry>(registry);
  for (const ChainCamera& camera : chain.cameras) {
    rig.cameras.push_back(
        {registry.make_camera(camera.description),
         camera.cam_from_rig,
         camera.description,
         [models](const CameraDescription& other) { return models->make_camera(other); },
         camera.readout_s});
  }
  return rig;
}

Rigid3 rigid_from_matrix(const Eigen::Matrix4d& matrix,
                         const std::string& where,
                         std::string_view name) {
  if (!matrix.allFinite()) {
    throw InputError(where, fmt::format("{} holds NaN or infinity, expected numbers", name));
  }
  const Eigen::RowVector4d last_row(0.0, 0.0, 0.0, 1.0);
  if ((matrix.row(3) - last_row).cwiseAbs().maxCoeff() > kMaxLastRowError) {
    throw InputError(where,
                     fmt::format("{} has another last row than 0 0 0 1, expected a rigid "
                                 "transformation",
                                 name));
  }
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const Eigen::Matrix3d gram = rotation.transpose() * rotation;
  const double error = (gram - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (error > kMaxRotationError || rotation.determinant() < 0.0) {
    throw InputError(
        where,
        fmt::format(
            "{} has no rotation in its 3x3 part ({}), expected orthonormal columns within {}",
            name,
            error > kMaxRotationError ? fmt::format("off by {:.2g}", error) : "mirrored",
            kMaxRotationError));
  }
  // The nearest rotation in the least-squares sense.
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rotation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d nearest = svd.matrixU() * svd.matrixV().transpose();
  return {Eigen::Quaterniond(nearest).normalized(), matrix.topRightCorner<3, 1>()};
}

}  // namespace waymark

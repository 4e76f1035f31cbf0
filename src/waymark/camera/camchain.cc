// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/camchain.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

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
/// Who is less sure than that need not say so.
constexpr double kMaxSigma = 1e5;
constexpr double kMaxSigmaMrad = 1e3;
constexpr double kRadPerMrad = 1e-3;

bool is_camera_key(std::string_view key) {
  return key.size() > 3 && key.starts_with("cam") &&
         std::all_of(key.begin() + 3, key.end(), [](unsigned char c) { return std::isdigit(c); });
}

bool is_ignored_key(std::string_view key) { return key == "rostopic" || key == "cam_overlaps"; }

void check_keys(const ConfigNode& camera, const std::string& name, CameraChain& chain) {
  const std::vector<std::string> known = {name + ".camera_model",
                                          name + ".intrinsics",
                                          name + ".intrinsics_sigma",
                                          name + ".distortion_model",
                                          name + ".distortion_coeffs",
                                          name + ".distortion_coeffs_sigma",
                                          name + ".resolution",
                                          name + ".T_cn_cnm1",
                                          name + ".T_cn_cnm1_sigma",
                                          name + ".readout_ms",
                                          name + ".T_cam_imu",
                                          name + ".timeshift_cam_imu"};
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

Rigid3 read_cam_from_rig(const ConfigNode& camera, const std::string& name, CameraChain& chain) {
  if (chain.cameras.empty()) {
    for (const char* key : {"T_cn_cnm1", "T_cn_cnm1_sigma"}) {
      const ConfigNode* node = camera.find(key);
      if (node == nullptr) continue;
      throw InputError(
          node->where(),
          fmt::format(
              "{}.{} is given, expected none, for camera 0 is the origin of the rig", name, key));
    }
    return Rigid3();
  }
  const Rigid3 cam_from_previous =
      read_transform(require(camera, name, "T_cn_cnm1"), name + ".T_cn_cnm1");
  return cam_from_previous * chain.cameras.back().cam_from_rig;
}

void expect_section(const ConfigNode& node, const std::string& key) {
  if (node.kind == ConfigNode::Kind::kMap) return;
  throw InputError(
      node.where(),
      fmt::format("{} is {}, expected a section of KEY: VALUE", key, describe_value(node)));
}

/// A list of standard deviations, as many as there are numbers; none where there is no such key.
std::vector<double> read_sigmas(const ConfigNode& section,
                                const std::string& name,
                                const char* key,
                                std::size_t count,
                                double highest) {
  const ConfigNode* node = section.find(key);
  if (node == nullptr) return {};
  const std::string full_key = name + "." + key;
  std::vector<double> sigmas = config_doubles(*node, full_key, {.low = 0.0, .high = highest});
  if (sigmas.size() == count) return sigmas;
  throw InputError(node->where(),
                   fmt::format("{} has {} numbers, expected {}, a standard deviation for each",
                               full_key,
                               sigmas.size(),
                               count));
}

/// How sure the calibration of a camera is, that was read before.
CalibrationSigmas read_all_sigmas(const ConfigNode& camera,
                                  const std::string& name,
                                  const CameraDescription& description) {
  CalibrationSigmas sigmas;
  sigmas.intrinsics =
      read_sigmas(camera, name, "intrinsics_sigma", description.intrinsics.size(), kMaxSigma);
  sigmas.distortion_coeffs = read_sigmas(
      camera, name, "distortion_coeffs_sigma", description.distortion_coeffs.size(), kMaxSigma);
  const ConfigNode* turns = camera.find("T_cn_cnm1_sigma");
  if (turns == nullptr) return sigmas;
  const std::string key = name + ".T_cn_cnm1_sigma";
  expect_section(*turns, key);
  const std::vector<std::string> known = {key + ".rotation_mrad", key + ".baseline_direction_mrad"};
  for (std::size_t i = 0; i < turns->items.size(); ++i) {
    const std::string given = key + "." + turns->keys[i];
    if (std::ranges::find(known, given) == known.end()) {
      fail_unknown_key(turns->items[i], given, known);
    }
  }
  sigmas.rotation_rad = read_sigmas(*turns, key, "rotation_mrad", 3, kMaxSigmaMrad);
  sigmas.baseline_direction_rad =
      read_sigmas(*turns, key, "baseline_direction_mrad", 2, kMaxSigmaMrad);
  for (double& sigma : sigmas.rotation_rad) sigma *= kRadPerMrad;
  for (double& sigma : sigmas.baseline_direction_rad) sigma *= kRadPerMrad;
  return sigmas;
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

std::string format_list(const std::vector<double>& values) {
  return fmt::format("[{}]", fmt::join(values, ", "));
}

/// "KEY: [...]" with the digits that mean something; nothing where there is nothing to say.
std::string format_sigmas(const char* key, std::vector<double> sigmas, double unit = 1.0) {
  if (sigmas.empty()) return "";
  for (double& sigma : sigmas) sigma /= unit;
  return fmt::format("{}: [{:.4g}]", key, fmt::join(sigmas, ", "));
}

std::string format_camera(const ChainCamera& camera) {
  const CameraDescription& description = camera.description;
  const CalibrationSigmas& sigmas = camera.sigmas;
  std::string text;
  const auto add = [&text](const std::string& line) {
    if (!line.empty()) text += "  " + line + "\n";
  };
  add("camera_model: " + description.camera_model);
  if (!description.intrinsics.empty()) add("intrinsics: " + format_list(description.intrinsics));
  add(format_sigmas("intrinsics_sigma", sigmas.intrinsics));
  add("distortion_model: " + description.distortion_model);
  if (!description.distortion_coeffs.empty()) {
    add("distortion_coeffs: " + format_list(description.distortion_coeffs));
  }
  add(format_sigmas("distortion_coeffs_sigma", sigmas.distortion_coeffs));
  add(fmt::format("resolution: [{}, {}]", description.width_px, description.height_px));
  if (camera.readout_s != 0.0) add(fmt::format("readout_ms: {:.6g}", 1e3 * camera.readout_s));
  return text;
}

std::string format_transform(const ChainCamera& camera, const ChainCamera& previous) {
  const Eigen::Matrix4d from_previous =
      (camera.cam_from_rig * previous.cam_from_rig.inverse()).matrix();
  std::string text = "  T_cn_cnm1:\n";
  for (int row = 0; row < 4; ++row) {
    text += fmt::format("  - [{}]\n", fmt::join(from_previous.row(row), ", "));
  }
  const CalibrationSigmas& sigmas = camera.sigmas;
  const std::string turn = format_sigmas("rotation_mrad", sigmas.rotation_rad, kRadPerMrad);
  const std::string baseline =
      format_sigmas("baseline_direction_mrad", sigmas.baseline_direction_rad, kRadPerMrad);
  if (turn.empty() && baseline.empty()) return text;
  const char* comma = turn.empty() || baseline.empty() ? "" : ", ";
  return text + fmt::format("  T_cn_cnm1_sigma: {{{}{}{}}}\n", turn, comma, baseline);
}

}  // namespace

Eigen::MatrixXd read_square_matrix(const ConfigNode& node, const std::string& key, int size) {
  const auto fail_shape = [&] {
    throw InputError(
        node.where(),
        fmt::format(
            "{0} is {1}, expected {2} rows of {2} numbers", key, describe_value(node), size));
  };
  const auto count = static_cast<std::size_t>(size);
  if (node.kind != ConfigNode::Kind::kList || node.items.size() != count) fail_shape();
  Eigen::MatrixXd matrix(size, size);
  for (int row = 0; row < size; ++row) {
    const std::vector<double> values =
        config_doubles(node.items[static_cast<std::size_t>(row)], fmt::format("{}[{}]", key, row));
    if (values.size() != count) fail_shape();
    matrix.row(row) = Eigen::Map<const Eigen::RowVectorXd>(values.data(), size);
  }
  return matrix;
}

Rigid3 read_transform(const ConfigNode& node, const std::string& key) {
  return rigid_from_matrix(read_square_matrix(node, key, 4), node.where(), key);
}

std::optional<CameraChain> read_camchain(const ConfigNode& config) {
  CameraChain chain;
  while (chain.cameras.size() < kMaxCameras) {
    const std::string name = fmt::format("cam{}", chain.cameras.size());
    const ConfigNode* camera = config.find(name);
    if (camera == nullptr) break;
    expect_section(*camera, name);
    check_keys(*camera, name, chain);
    if (chain.cameras.size() >= kMaxUsedCameras) {
      chain.notes.push_back(
          fmt::format("{}: {} is ignored, cam0 and cam1 at most are used", camera->where(), name));
    }
    const CameraDescription description = read_description(*camera, name);
    const Rigid3 cam_from_rig = read_cam_from_rig(*camera, name, chain);
    ChainCamera& read = chain.cameras.emplace_back(
        ChainCamera{description, cam_from_rig, 0.0, read_all_sigmas(*camera, name, description)});
    if (const ConfigNode* readout = camera->find("readout_ms")) {
      read.readout_s =
          1e-3 * config_double(*readout, name + ".readout_ms", {.low = -1e3, .high = 1e3});
    }
  }
  check_numbering(config, chain.cameras.size());
  if (chain.cameras.empty()) return std::nullopt;
  chain.depth_factor = read_depth_factor(config);
  return chain;
}

std::optional<double> read_depth_factor(const ConfigNode& config) {
  const ConfigNode* depth = config.find("depth");
  const ConfigNode* factor = depth == nullptr ? nullptr : depth->find("factor");
  if (factor == nullptr) return std::nullopt;
  return config_double(*factor, "depth.factor", {.low = 1e-3, .high = 1e9});
}

std::string format_camchain(const CameraChain& chain) {
  std::string text;
  for (std::size_t i = 0; i < chain.cameras.size(); ++i) {
    text += fmt::format("cam{}:\n", i) + format_camera(chain.cameras[i]);
    if (i > 0) text += format_transform(chain.cameras[i], chain.cameras[i - 1]);
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
         camera.readout_s,
         camera.sigmas});
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

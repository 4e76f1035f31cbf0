// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/openvslam_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <initializer_list>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

constexpr int kMaxSizePx = 20000;

int size_px(const OpenvslamCamera& camera, const char* key) {
  const double size = camera.require(key);
  if (!(size >= 1.0 && size <= kMaxSizePx) || size != std::floor(size)) {
    throw InputError(
        camera.where,
        fmt::format("{} is {}, expected a whole number from 1 to {}", key, size, kMaxSizePx));
  }
  return static_cast<int>(size);
}

/// Coefficients; those that are not there are 0. Empty if all are.
std::vector<double> coefficients(const OpenvslamCamera& camera,
                                 std::initializer_list<const char*> keys) {
  std::vector<double> coeffs;
  for (const char* key : keys) coeffs.push_back(camera.find(key).value_or(0.0));
  const bool has_any = std::any_of(coeffs.begin(), coeffs.end(), [](double c) { return c != 0.0; });
  return has_any ? coeffs : std::vector<double>();
}

CameraDescription describe(const OpenvslamCamera& camera) {
  CameraDescription description;
  description.where = camera.where;
  description.width_px = size_px(camera, "cols");
  description.height_px = size_px(camera, "rows");
  description.camera_model = "pinhole";
  const std::string model = normalized_name(camera.model);
  if (model == "equirectangular") {
    description.camera_model = "equirectangular";
    return description;
  }
  for (const char* key : {"fx", "fy", "cx", "cy"}) {
    description.intrinsics.push_back(camera.require(key));
  }
  if (model == "perspective") {
    description.distortion_coeffs = coefficients(camera, {"k1", "k2", "p1", "p2", "k3"});
    if (!description.distortion_coeffs.empty()) description.distortion_model = "radtan";
  } else if (model == "fisheye") {
    description.distortion_model = "equidistant";
    for (const char* key : {"k1", "k2", "k3", "k4"}) {
      description.distortion_coeffs.push_back(camera.find(key).value_or(0.0));
    }
  } else if (model == "radialdivision") {
    description.camera_model = "division";
    description.distortion_coeffs = {camera.require("distortion")};
  } else {
    throw InputError(camera.where,
                     fmt::format("model {}, expected perspective, fisheye, equirectangular or "
                                 "radial_division",
                                 quote_for_message(camera.model)));
  }
  return description;
}

}  // namespace

std::optional<double> OpenvslamCamera::find(std::string_view key) const {
  const auto found = numbers.find(key);
  if (found == numbers.end()) return std::nullopt;
  return found->second;
}

double OpenvslamCamera::require(std::string_view key) const {
  const std::optional<double> value = find(key);
  if (!value) throw InputError(where, fmt::format("has no {}, which is needed", key));
  return *value;
}

std::string normalized_name(std::string_view name) {
  std::string normalized;
  for (const unsigned char c : name) {
    if (std::isalnum(c)) normalized += static_cast<char>(std::tolower(c));
  }
  return normalized;
}

Setup openvslam_setup(const OpenvslamCamera& camera) {
  const std::string setup = normalized_name(camera.setup);
  if (setup == "monocular") return Setup::kMono;
  if (setup == "stereo") return Setup::kStereo;
  if (setup == "rgbd") return Setup::kRgbd;
  throw InputError(camera.where,
                   fmt::format("set-up {}, expected monocular, stereo or RGBD",
                               quote_for_message(camera.setup)));
}

CameraChain openvslam_camchain(const OpenvslamCamera& camera) {
  CameraChain chain;
  chain.cameras.push_back({describe(camera), Rigid3()});
  if (openvslam_setup(camera) == Setup::kStereo) {
    const double baseline = camera.require("focal_x_baseline") / camera.require("fx");
    if (!(baseline > 0.0 && std::isfinite(baseline))) {
      throw InputError(camera.where,
                       fmt::format("focal_x_baseline / fx is {}, expected the distance of the "
                                   "cameras of a stereo pair, more than 0",
                                   baseline));
    }
    const Rigid3 cam1_from_cam0(Eigen::Quaterniond::Identity(), {-baseline, 0.0, 0.0});
    chain.cameras.push_back({chain.cameras[0].description, cam1_from_cam0});
  }
  make_rig(chain);  // Refuses what no model accepts.
  return chain;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/foreign_calibration.h"

namespace waymark {
namespace {

using NerfstudioJson = nlohmann::json;

/// Numbers of the camera: those of the whole file or, where it has none, of the first frame.
class NerfstudioCamera {
 public:
  NerfstudioCamera(const NerfstudioJson& root, const std::string& file) : file_(file) {
    if (!root.is_object()) fail("is no JSON object");
    objects_.push_back(&root);
    const auto frames = root.find("frames");
    if (frames == root.end() || !frames->is_array() || frames->empty()) return;
    if (frames->front().is_object()) objects_.push_back(&frames->front());
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(file_, what + ", expected transforms.json with fl_x, fl_y, cx, cy, w, h");
  }

  std::optional<double> find(const char* key) const {
    for (const NerfstudioJson* object : objects_) {
      const auto value = object->find(key);
      if (value == object->end()) continue;
      if (value->is_number() && std::abs(value->get<double>()) < 1e9) return value->get<double>();
      fail(fmt::format("has a {} that is no number", key));
    }
    return std::nullopt;
  }

  double require(const char* key) const {
    const std::optional<double> value = find(key);
    return value ? *value : throw InputError(file_, fmt::format("has no {}, which is needed", key));
  }

  int size_px(const char* key) const {
    const double size = require(key);
    if (size >= 1.0 && size <= 1e6 && size == std::floor(size)) return static_cast<int>(size);
    throw InputError(file_, fmt::format("{} is {} pixels, expected an integer from 1", key, size));
  }

  std::string model() const {
    for (const NerfstudioJson* object : objects_) {
      const auto value = object->find("camera_model");
      if (value != object->end() && value->is_string()) return value->get<std::string>();
    }
    return "OPENCV";
  }

  /// Focal length, or that of an angle of view as instant-ngp writes it.
  std::optional<double> find_focal_px(const char* key, const char* angle_key, double size) const {
    if (const auto focal = find(key)) return focal;
    const auto angle = find(angle_key);
    if (!angle || !(*angle > 0.0 && *angle < 3.14)) return std::nullopt;
    return 0.5 * size / std::tan(0.5 * *angle);
  }

 private:
  std::string file_;
  std::vector<const NerfstudioJson*> objects_;
};

void set_distortion(const NerfstudioCamera& camera,
                    const std::string& model,
                    CameraDescription& description) {
  const auto value = [&](const char* key) { return camera.find(key).value_or(0.0); };
  if (model == "OPENCV_FISHEYE") {
    description.distortion_model = "equidistant";
    description.distortion_coeffs = {value("k1"), value("k2"), value("k3"), value("k4")};
    return;
  }
  if (model != "OPENCV" && model != "PINHOLE" && model != "SIMPLE_PINHOLE") {
    camera.fail(
        fmt::format("has cameras of the model {}, which is none of OPENCV, OPENCV_FISHEYE, "
                    "PINHOLE, EQUIRECTANGULAR",
                    quote_for_message(model)));
  }
  // Its k3 and k4 are further radial terms of a polynomial; OpenCV's, and ours, has no fourth one.
  if (value("k4") != 0.0) camera.fail("has a fourth radial term (k4), which has no counterpart");
  std::vector<double> coeffs = {value("k1"), value("k2"), value("p1"), value("p2"), value("k3")};
  if (coeffs == std::vector<double>(5, 0.0)) return;
  if (coeffs.back() == 0.0) coeffs.pop_back();
  description.distortion_model = "radtan";
  description.distortion_coeffs = std::move(coeffs);
}

}  // namespace

CameraChain read_nerfstudio_calibration(const ConfigSource& source) {
  const NerfstudioJson root = NerfstudioJson::parse(source.text, nullptr, /*throw=*/false);
  if (root.is_discarded()) {
    throw InputError(source.name, "is no JSON, expected transforms.json of nerfstudio");
  }
  const NerfstudioCamera camera(root, source.name);
  CameraDescription description;
  description.where = source.name;
  description.width_px = camera.size_px("w");
  description.height_px = camera.size_px("h");
  const std::string model = camera.model();
  if (model == "EQUIRECTANGULAR") {
    description.camera_model = "equirectangular";
  } else {
    description.camera_model = "pinhole";
    const double center_x = camera.find("cx").value_or(0.5 * description.width_px);
    const double center_y = camera.find("cy").value_or(0.5 * description.height_px);
    const auto horizontal = camera.find_focal_px("fl_x", "camera_angle_x", description.width_px);
    const auto vertical = camera.find_focal_px("fl_y", "camera_angle_y", description.height_px);
    const double fu = horizontal ? *horizontal : camera.require("fl_x");
    description.intrinsics = {fu, vertical.value_or(fu), center_x - 0.5, center_y - 0.5};
    set_distortion(camera, model, description);
  }
  CameraChain chain;
  chain.cameras.push_back({description, Rigid3()});
  make_rig(chain);  // Refuses what no model accepts.
  return chain;
}

}  // namespace waymark

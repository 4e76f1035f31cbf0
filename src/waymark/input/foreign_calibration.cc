// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/foreign_calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/config_value.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

using Keys = std::initializer_list<const char*>;

const ConfigNode* find_any(const ConfigNode& map, Keys keys) {
  for (const char* key : keys) {
    const ConfigNode* node = map.kind == ConfigNode::Kind::kMap ? map.find(key) : nullptr;
    if (node != nullptr) return node;
  }
  return nullptr;
}

const ConfigNode& require_any(const ConfigNode& map, const std::string& file, Keys keys) {
  const ConfigNode* node = find_any(map, keys);
  if (node == nullptr) {
    throw InputError(file, fmt::format("has no {}, which is needed", *keys.begin()));
  }
  return *node;
}

/// The numbers of a matrix: {rows, cols, data}, or a list.
std::vector<double> matrix_values(const ConfigNode& node, const std::string& key) {
  if (node.kind != ConfigNode::Kind::kMap) return config_doubles(node, key);
  const ConfigNode* data = node.find("data");
  if (data == nullptr) {
    throw InputError(node.where(), fmt::format("{} has no data, expected rows, cols, data", key));
  }
  return config_doubles(*data, key + ".data");
}

CameraDescription read_size_and_matrix(const ConfigNode& root, const std::string& file) {
  CameraDescription camera;
  camera.camera_model = "pinhole";
  camera.where = file;
  const ConfigRange size{.low = 1, .high = 1e6};
  camera.width_px = config_int(
      require_any(root, file, {"image_width", "imageWidth", "width"}), "image_width", size);
  camera.height_px = config_int(
      require_any(root, file, {"image_height", "imageHeight", "height"}), "image_height", size);
  const ConfigNode& node =
      require_any(root, file, {"camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "k"});
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

/// OpenCV's order is that of radtan: k1 k2 p1 p2 k3 k4 k5 k6, then thin prism and tilt.
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

bool is_ros_model(std::string_view model) {
  return model == "equidistant" || model == "fisheye" || model == "plumb_bob" ||
         model == "rational_polynomial" || model == "Brown Conrady";  // By RealSense's recorder.
}

CameraChain checked_chain(const CameraDescription& camera) {
  CameraChain chain;
  chain.cameras.push_back({camera, Rigid3()});
  make_rig(chain);  // Refuses what no model accepts.
  return chain;
}

/// A model of COLMAP's documentation ("Camera Models") in terms of ours: where each number comes
/// from, as an index into its parameters, or kZero.
struct ColmapCameraModel {
  std::string_view name;
  std::size_t num_parameters;
  std::array<int, 4> intrinsics;  ///< fu fv pu pv.
  const char* distortion_model;
  std::vector<int> distortion;
};

constexpr int kZero = -1;

const std::vector<ColmapCameraModel>& colmap_models() {
  static const std::vector<ColmapCameraModel> models = {
      {"SIMPLE_PINHOLE", 3, {0, 0, 1, 2}, "none", {}},
      {"PINHOLE", 4, {0, 1, 2, 3}, "none", {}},
      {"SIMPLE_RADIAL", 4, {0, 0, 1, 2}, "radtan", {3, kZero, kZero, kZero}},
      {"RADIAL", 5, {0, 0, 1, 2}, "radtan", {3, 4, kZero, kZero}},
      {"OPENCV", 8, {0, 1, 2, 3}, "radtan", {4, 5, 6, 7}},
      {"FULL_OPENCV", 12, {0, 1, 2, 3}, "radtan", {4, 5, 6, 7, 8, 9, 10, 11}},
      {"OPENCV_FISHEYE", 8, {0, 1, 2, 3}, "equidistant", {4, 5, 6, 7}},
      {"SIMPLE_RADIAL_FISHEYE", 4, {0, 0, 1, 2}, "equidistant", {3, kZero, kZero, kZero}},
      {"RADIAL_FISHEYE", 5, {0, 0, 1, 2}, "equidistant", {3, 4, kZero, kZero}},
  };
  return models;
}

const ColmapCameraModel& find_model(std::string_view name, const std::string& where) {
  std::string known;
  for (const ColmapCameraModel& model : colmap_models()) {
    if (model.name == name) return model;
    known += (known.empty() ? "" : ", ") + std::string(model.name);
  }
  throw InputError(where,
                   fmt::format("model is {}, expected one of: {}", quote_for_message(name), known));
}

int pixels(const RowReader& rows, std::size_t index) {
  const double value = rows.number(index);
  if (value >= 1.0 && value <= 1e6 && value == static_cast<int>(value)) {
    return static_cast<int>(value);
  }
  throw InputError(rows.where(),
                   fmt::format("size is {} pixels, expected an integer from 1", value));
}

/// Without its size.
CameraDescription camera_of(const ColmapCameraModel& model,
                            const std::vector<double>& parameters,
                            const std::string& where) {
  const auto parameter = [&](int index) {
    return index == kZero ? 0.0 : parameters[static_cast<std::size_t>(index)];
  };
  CameraDescription camera;
  camera.where = where;
  camera.camera_model = "pinhole";
  for (const int index : model.intrinsics) camera.intrinsics.push_back(parameter(index));
  camera.intrinsics[2] -= 0.5;
  camera.intrinsics[3] -= 0.5;
  camera.distortion_model = model.distortion_model;
  for (const int index : model.distortion) camera.distortion_coeffs.push_back(parameter(index));
  return camera;
}

CameraDescription read_camera(const RowReader& rows) {
  constexpr std::size_t kFirst = 4;  // CAMERA_ID MODEL WIDTH HEIGHT, then the parameters.
  rows.expect_at_least(kFirst, "CAMERA_ID MODEL WIDTH HEIGHT PARAMS...");
  const ColmapCameraModel& model = find_model(rows.fields()[1], rows.where());
  const std::size_t count = rows.fields().size() - kFirst;
  if (count != model.num_parameters) {
    throw InputError(
        rows.where(),
        fmt::format("{} has {} parameters, expected {}", model.name, count, model.num_parameters));
  }
  std::vector<double> parameters;
  for (std::size_t i = 0; i < count; ++i) parameters.push_back(rows.number(kFirst + i));
  CameraDescription camera = camera_of(model, parameters, rows.where());
  camera.width_px = pixels(rows, 2);
  camera.height_px = pixels(rows, 3);
  return camera;
}

/// Numbers of a binary file, little-endian as COLMAP writes them.
class BinaryNumbers {
 public:
  explicit BinaryNumbers(const ConfigSource& source) : source_(source) {}

  template <class T>
  T next() {
    T value;
    if (source_.text.size() - at_ < sizeof value) {
      throw InputError(source_.name, "is cut off, expected cameras.bin of a COLMAP model");
    }
    std::memcpy(&value, source_.text.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }

 private:
  const ConfigSource& source_;
  std::size_t at_ = 0;
};

/// cameras.bin: the number of cameras, then of each its id, model, size and parameters.
CameraChain read_binary_cameras(const ConfigSource& source) {
  // In the order of the numbers that COLMAP's documentation gives its models.
  constexpr std::array kModels = {"SIMPLE_PINHOLE",
                                  "PINHOLE",
                                  "SIMPLE_RADIAL",
                                  "RADIAL",
                                  "OPENCV",
                                  "OPENCV_FISHEYE",
                                  "FULL_OPENCV",
                                  "FOV",
                                  "SIMPLE_RADIAL_FISHEYE",
                                  "RADIAL_FISHEYE",
                                  "THIN_PRISM_FISHEYE"};
  BinaryNumbers numbers(source);
  const auto num_cameras = numbers.next<std::uint64_t>();
  numbers.next<std::uint32_t>();  // The id.
  const auto number = numbers.next<std::int32_t>();
  const auto width = numbers.next<std::uint64_t>();
  const auto height = numbers.next<std::uint64_t>();
  const bool is_one = num_cameras > 0 && number >= 0 && number < std::ssize(kModels) && width > 0 &&
                      width <= 1'000'000 && height > 0 && height <= 1'000'000;
  if (!is_one) {
    throw InputError(source.name, "begins with no camera, expected cameras.bin of a COLMAP model");
  }
  const ColmapCameraModel& model =
      find_model(kModels[static_cast<std::size_t>(number)], source.name);
  std::vector<double> parameters;
  for (std::size_t i = 0; i < model.num_parameters; ++i) {
    parameters.push_back(numbers.next<double>());
    if (std::isfinite(parameters.back())) continue;
    throw InputError(source.name, "has a parameter that is no number, expected finite ones");
  }
  CameraChain chain;
  chain.cameras.push_back({camera_of(model, parameters, source.name), Rigid3()});
  chain.cameras[0].description.width_px = static_cast<int>(width);
  chain.cameras[0].description.height_px = static_cast<int>(height);
  make_rig(chain);  // Refuses what no model accepts.
  if (num_cameras > 1) {
    chain.notes.push_back(
        fmt::format("{}: the first of {} cameras is taken", source.name, num_cameras));
  }
  return chain;
}

bool has_any_key(const ConfigNode& root, Keys keys) { return find_any(root, keys) != nullptr; }

/// Whether a row that is no comment names a model after a number.
bool is_colmap_text(const ConfigSource& source) {
  constexpr std::size_t kLongestRow = 1000;
  std::string_view text = source.text;
  while (!text.empty()) {
    const std::string_view row = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), row.size() + 1));
    if (row.empty() || row.front() == '#') continue;
    if (row.size() > kLongestRow) return false;
    RowReader rows(row, source.name, ' ');
    if (!rows.next() || rows.fields().size() < 5) return false;
    const std::string_view model = rows.fields()[1];
    return is_digit(rows.fields()[0].front()) &&
           std::ranges::all_of(model, [](char c) { return c == '_' || (c >= 'A' && c <= 'Z'); });
  }
  return false;
}

}  // namespace

ConfigSource without_opencv_header(ConfigSource source) {
  if (source.text.starts_with("%YAML:")) source.text.replace(0, 1, "#");
  return source;
}

CameraChain read_opencv_calibration(const ConfigSource& source) {
  const ConfigNode root = parse_config(without_opencv_header(source));
  CameraDescription camera = read_size_and_matrix(root, source.name);
  const ConfigNode* node = find_any(
      root,
      {"distortion_coefficients", "distCoeffs", "Distortion_Coefficients", "dist_coeffs", "D"});
  std::vector<double> coeffs;
  if (node != nullptr) coeffs = matrix_values(*node, "distortion_coefficients");
  const ConfigNode* fisheye = find_any(root, {"fisheye_model"});
  if (fisheye != nullptr && config_int(*fisheye, "fisheye_model", {.low = 0, .high = 1}) == 1) {
    set_equidistant(camera, std::move(coeffs));
  } else {
    set_radial_tangential(camera, std::move(coeffs), node ? node->where() : source.name);
  }
  return checked_chain(camera);
}

CameraChain read_ros_calibration(const ConfigSource& source) {
  const ConfigNode root = parse_config(source);
  CameraDescription camera = read_size_and_matrix(root, source.name);
  const ConfigNode& model_node = require_any(root, source.name, {"distortion_model"});
  const std::string model = config_string(model_node, "distortion_model");
  const ConfigNode* node = find_any(root, {"distortion_coefficients", "D", "d"});
  std::vector<double> coeffs;
  if (node != nullptr) coeffs = matrix_values(*node, "distortion_coefficients");
  const bool is_of_model = is_ros_model(model) && node != nullptr;
  set_ros_distortion(
      camera, model, std::move(coeffs), is_of_model ? node->where() : model_node.where());
  return checked_chain(camera);
}

void set_ros_distortion(CameraDescription& camera,
                        std::string_view model,
                        std::vector<double> coeffs,
                        const std::string& where) {
  if (!is_ros_model(model)) {
    throw InputError(where,
                     fmt::format("distortion_model is {}, expected plumb_bob, "
                                 "rational_polynomial, equidistant or fisheye",
                                 quote_for_message(model)));
  }
  if (model == "equidistant" || model == "fisheye") {
    set_equidistant(camera, std::move(coeffs));
  } else {
    set_radial_tangential(camera, std::move(coeffs), where);
  }
}

CameraChain read_colmap_calibration(const ConfigSource& source) {
  if (source.text.find('\0') != std::string::npos) return read_binary_cameras(source);
  RowReader rows(source.text, source.name, ' ');
  if (!rows.next()) {
    throw InputError(source.name, "holds no camera, expected cameras.txt of a COLMAP text model");
  }
  CameraChain chain;
  chain.cameras.push_back({read_camera(rows), Rigid3()});
  make_rig(chain);  // Refuses what no model accepts.
  std::size_t num_cameras = 1;
  while (rows.next()) ++num_cameras;
  if (num_cameras > 1) {
    chain.notes.push_back(
        fmt::format("{}: the first of {} cameras is taken", source.name, num_cameras));
  }
  return chain;
}

std::optional<CalibrationKind> recognize_calibration(const ConfigSource& source) {
  const bool is_binary = source.name.ends_with(".bin");
  if (is_binary || is_colmap_text(source)) return CalibrationKind::kColmap;
  const std::size_t first = source.text.find_first_not_of(" \t\r\n");
  if (first != std::string::npos && source.text[first] == '{') {
    for (const char* key : {"\"frames\"", "\"fl_x\"", "\"camera_angle_x\""}) {
      if (source.text.find(key) != std::string::npos) return CalibrationKind::kNerfstudio;
    }
  }
  const ConfigNode root = parse_config(without_opencv_header(source));
  if (!has_any_key(root, {"camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "k"})) {
    return std::nullopt;
  }
  return has_any_key(root, {"distortion_model"}) ? CalibrationKind::kRos : CalibrationKind::kOpencv;
}

CameraChain read_calibration(CalibrationKind kind, const ConfigSource& source) {
  switch (kind) {
    case CalibrationKind::kOpencv:
      return read_opencv_calibration(source);
    case CalibrationKind::kRos:
      return read_ros_calibration(source);
    case CalibrationKind::kColmap:
      return read_colmap_calibration(source);
    case CalibrationKind::kNerfstudio:
      return read_nerfstudio_calibration(source);
  }
  fail_check("known CalibrationKind", __FILE__, __LINE__);
}

}  // namespace waymark

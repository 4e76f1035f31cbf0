// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/foreign_calibration.h"

namespace waymark {
namespace {

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

}  // namespace

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

}  // namespace waymark

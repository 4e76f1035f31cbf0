// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/config_value.h"
#include "waymark/base/text.h"
#include "waymark/input/bag_calibration.h"
#include "waymark/input/calibration_parts.h"
#include "waymark/input/foreign_calibration.h"

namespace waymark {
namespace {

bool is_ros_model(std::string_view model) {
  return model == "equidistant" || model == "fisheye" || model == "plumb_bob" ||
         model == "rational_polynomial" || model == "Brown Conrady";  // By RealSense's recorder.
}

/// The documents of a file, each ended by a line of ---, as `ros2 topic echo` writes messages.
std::vector<ConfigSource> messages_of(const ConfigSource& source) {
  std::vector<ConfigSource> messages;
  std::string message;
  bool has_content = false;
  const auto end_message = [&] {
    const std::string name = messages.empty()
                                 ? source.name
                                 : fmt::format("{} (message {})", source.name, messages.size() + 1);
    if (has_content) messages.push_back({name, std::exchange(message, {})});
    has_content = false;
  };
  std::string_view rest = source.text;
  while (!rest.empty()) {
    std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(rest.size(), line.size() + 1));
    while (!line.empty() && (line.back() == ' ' || line.back() == '\r')) line.remove_suffix(1);
    if (line == "---") {
      end_message();
    } else {
      has_content |= !line.empty() && line.front() != '#';
    }
    // So that lines keep their numbers in the first message.
    message.append(line == "---" ? "" : line).append("\n");
  }
  end_message();
  return messages;
}

/// A camera, and what its file says of the pair that it may be of.
struct RosCamera {
  CameraDescription description;
  RosCameraInfo info;

  bool is_same(const RosCamera& other) const {
    return description.is_same(other.description) && info.r == other.info.r &&
           info.p == other.info.p;
  }
};

template <std::size_t kSize>
void copy_matrix(const ConfigNode& root, const Keys& keys, std::array<double, kSize>& matrix) {
  const ConfigNode* node = find_any(root, keys);
  if (node == nullptr) return;
  const std::vector<double> values = matrix_values(*node, keys.front());
  if (values.size() != kSize) {
    throw InputError(
        node->where(),
        fmt::format("{} has {} numbers, expected {}", keys.front(), values.size(), kSize));
  }
  std::ranges::copy(values, matrix.begin());
}

RosCamera read_ros_message(const ConfigSource& source) {
  const ConfigNode root = parse_config(source);
  RosCamera camera{read_size_and_matrix(root, source.name), {}};
  const ConfigNode& model_node = require_any(root, source.name, {"distortion_model"});
  const std::string model = config_string(model_node, "distortion_model");
  const ConfigNode* node = find_any(root, {"distortion_coefficients", "D", "d"});
  std::vector<double> coeffs;
  if (node != nullptr) coeffs = matrix_values(*node, "distortion_coefficients");
  const bool is_of_model = is_ros_model(model) && node != nullptr;
  set_ros_distortion(camera.description,
                     model,
                     std::move(coeffs),
                     is_of_model ? node->where() : model_node.where());
  copy_matrix(root, {"rectification_matrix", "R", "r"}, camera.info.r);
  copy_matrix(root, {"projection_matrix", "P", "p"}, camera.info.p);
  return camera;
}

/// All messages are to be of one camera.
RosCamera read_ros_camera(const ConfigSource& source) {
  const std::vector<ConfigSource> messages = messages_of(source);
  RosCamera camera = read_ros_message(messages.empty() ? source : messages.front());
  for (std::size_t i = 1; i < messages.size(); ++i) {
    if (read_ros_message(messages[i]).is_same(camera)) continue;
    throw InputError(source.name,
                     fmt::format("message {} has other numbers than the first, expected messages "
                                 "of one camera",
                                 i + 1));
  }
  return camera;
}

}  // namespace

bool is_ros_calibration(const ConfigSource& source) {
  constexpr std::size_t kMaxBytes = std::size_t{1} << 20;
  if (source.text.starts_with("%YAML:") || source.text.size() > kMaxBytes) return false;
  const std::vector<ConfigSource> messages = messages_of(source);
  if (messages.empty()) return false;
  try {
    const ConfigNode root = parse_config(messages.front());
    return find_any(root, matrix_keys()) != nullptr && root.find("distortion_model") != nullptr;
  } catch (const InputError&) {
    return false;
  }
}

CameraChain read_ros_calibration(const ConfigSource& source) {
  return checked_chain(read_ros_camera(source).description);
}

CameraChain read_ros_pair(const ConfigSource& camera0, const ConfigSource& camera1) {
  const RosCamera first = read_ros_camera(camera0);
  const RosCamera second = read_ros_camera(camera1);
  const auto cam1_from_cam0 = right_from_left(first.info, second.info, false, camera1.name);
  if (!cam1_from_cam0) {
    throw InputError(camera1.name,
                     fmt::format("has no baseline to {} in its projection_matrix, expected the two "
                                 "files of a stereo calibration, or one file",
                                 camera0.name));
  }
  CameraChain chain;
  chain.cameras = {{first.description, Rigid3()}, {second.description, *cam1_from_cam0}};
  make_rig(chain);  // Refuses what no model accepts.
  return chain;
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
    return;
  }
  // Drivers fill up with zeros to the eight of rational_polynomial.
  constexpr std::ptrdiff_t kPlumbBob = 5;
  const auto is_zero = [](double value) { return value == 0.0; };
  if (model == "plumb_bob" && std::ssize(coeffs) > kPlumbBob &&
      std::all_of(coeffs.begin() + kPlumbBob, coeffs.end(), is_zero)) {
    coeffs.resize(kPlumbBob);
  }
  set_radial_tangential(camera, std::move(coeffs), where);
}

}  // namespace waymark

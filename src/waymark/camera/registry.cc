// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/registry.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/camera/division.h"
#include "waymark/camera/equirectangular.h"
#include "waymark/camera/fisheye.h"
#include "waymark/camera/perspective.h"
#include "waymark/camera/pixel_angles.h"
#include "waymark/camera/unified.h"
#include "waymark/camera/unknown_camera.h"

namespace waymark {
namespace {

constexpr int kMinSizePx = 16;
constexpr int kMaxSizePx = 20000;
constexpr std::size_t kLongestMessage = 1000;
constexpr std::size_t kLongestName = 100;

void expect_finite(const CameraDescription& description,
                   std::string_view name,
                   const std::vector<double>& values) {
  for (const double value : values) {
    if (!std::isfinite(value)) {
      description.fail(fmt::format("{} holds {}, expected finite numbers", name, value));
    }
  }
}

/// What all models share.
void expect_sound_numbers(const CameraDescription& description) {
  const auto is_good_size = [](int size) { return size >= kMinSizePx && size <= kMaxSizePx; };
  if (!is_good_size(description.width_px) || !is_good_size(description.height_px)) {
    description.fail(fmt::format("resolution is [{}, {}], expected width and height from {} to {}",
                                 description.width_px,
                                 description.height_px,
                                 kMinSizePx,
                                 kMaxSizePx));
  }
  expect_finite(description, "intrinsics", description.intrinsics);
  expect_finite(description, "distortion_coeffs", description.distortion_coeffs);
}

/// A word that can be shown as it is.
bool is_name(std::string_view text) {
  return !text.empty() && text.size() <= kLongestName &&
         std::ranges::all_of(text, [](char c) { return c > 0x20 && c < 0x7F; });
}

// Calibrations are least certain in the extreme corners, where polynomials of real lenses may fold
// back; features are kept away from there. With more than this the numbers are wrong.
constexpr double kMaxInvalidPart = 0.5;
// Images of wider cameras have a circle with black corners, on the sensors in use often a half.
constexpr double kMaxInvalidPartWide = 0.6;
// 360 degree images are twice as wide as high, save for rounding.
constexpr double kMaxAspectError = 0.01;

using CameraPointer = std::shared_ptr<const Camera>;

/// The camera of a model, unless it folds back so far inside the image as only wrong numbers do.
template <class Model>
CameraPointer make_unfolded(const CameraDescription& description,
                            Model model,
                            std::string_view cause) {
  const double end_rad = model.max_angle_rad();
  auto camera = std::make_shared<const ModelCamera<Model>>(
      std::move(model), description.width_px, description.height_px);
  const double most = end_rad < 0.5 * std::numbers::pi ? kMaxInvalidPart : kMaxInvalidPartWide;
  const double part = part_without_bearing(*camera);
  if (part <= most) return camera;
  const Model& made = camera->parameters();
  const double inside_rad = end_rad * (1.0 - 1e-9);
  const auto end = made.project({std::sin(inside_rad), 0.0, std::cos(inside_rad)});
  const auto center = made.project({0.0, 0.0, 1.0});
  description.fail(fmt::format(
      "{} fold the image back at {:.0f} px from the principal point, {:.0f} degrees off the axis, "
      "which leaves {:.0f} % of the pixels without a direction, expected at most {:.0f} %",
      cause,
      end && center ? (*end - *center).norm() : 0.0,
      end_rad * 180.0 / std::numbers::pi,
      100.0 * part,
      100.0 * most));
}

void expect_num_coeffs(const CameraDescription& description, bool is_right, std::string_view what) {
  if (is_right) return;
  description.fail(fmt::format(
      "distortion_coeffs has {} numbers, expected {}", description.distortion_coeffs.size(), what));
}

void expect_range(const CameraDescription& description,
                  std::size_t index,
                  bool is_right,
                  std::string_view what) {
  if (is_right) return;
  description.fail(
      fmt::format("intrinsics[{}] is {}, expected {}", index, description.intrinsics[index], what));
}

/// The last four intrinsics: fu fv pu pv.
ImagePlane plane_of(const CameraDescription& description) {
  const std::vector<double>& values = description.intrinsics;
  const std::size_t first = values.size() - 4;
  return {{values[first], values[first + 1]}, {values[first + 2], values[first + 3]}};
}

/// `models`: all that distortion_model may be, for the message.
void expect_radtan_or_none(const CameraDescription& description, std::string_view models) {
  if (description.distortion_model == "none") return expect_no_distortion(description);
  if (description.distortion_model != "radtan") {
    description.fail(
        fmt::format("distortion_model is {}, expected {}", description.distortion_model, models));
  }
  const std::size_t count = description.distortion_coeffs.size();
  expect_num_coeffs(description,
                    count == 4 || count == 5 || count == 8,
                    "4, 5 or 8 for radtan: k1 k2 p1 p2 [k3 [k4 k5 k6]]");
}

CameraPointer make_fisheye(const CameraDescription& description) {
  const std::vector<double>& coeffs = description.distortion_coeffs;
  expect_num_coeffs(description, coeffs.size() == 4, "4 for equidistant: k1 k2 k3 k4");
  const FisheyeModel model(plane_of(description), {coeffs[0], coeffs[1], coeffs[2], coeffs[3]});
  return make_unfolded(description, model, "distortion_coeffs");
}

CameraPointer make_pinhole(const CameraDescription& description) {
  expect_intrinsics(description, "fu fv pu pv");
  if (description.distortion_model == "equidistant") return make_fisheye(description);
  expect_radtan_or_none(description, "radtan, equidistant or none");
  const ImagePlane plane = plane_of(description);
  const PerspectiveModel model(plane.focal_px, plane.center_px, description.distortion_coeffs);
  return make_unfolded(description, model, "distortion_coeffs");
}

CameraPointer make_omni(const CameraDescription& description) {
  expect_intrinsics(description, "xi fu fv pu pv");
  const double xi = description.intrinsics[0];
  expect_range(description, 0, xi >= 0.0, "xi of at least 0");
  expect_radtan_or_none(description, "radtan or none");
  const UnifiedModel model(xi, plane_of(description), description.distortion_coeffs);
  return make_unfolded(description, model, "xi and distortion_coeffs");
}

CameraPointer make_eucm(const CameraDescription& description) {
  expect_intrinsics(description, "alpha beta fu fv pu pv");
  expect_no_distortion(description);
  const double alpha = description.intrinsics[0], beta = description.intrinsics[1];
  expect_range(description, 0, alpha >= 0.0 && alpha <= 1.0, "alpha from 0 to 1");
  expect_range(description, 1, beta > 0.0, "beta of more than 0");
  return make_unfolded(
      description, ExtendedUnifiedModel(alpha, beta, plane_of(description)), "alpha and beta");
}

CameraPointer make_ds(const CameraDescription& description) {
  expect_intrinsics(description, "xi alpha fu fv pu pv");
  expect_no_distortion(description);
  const double xi = description.intrinsics[0], alpha = description.intrinsics[1];
  expect_range(description, 0, xi > -1.0 && xi <= 1.0, "xi of more than -1 and at most 1");
  expect_range(description, 1, alpha >= 0.0 && alpha <= 1.0, "alpha from 0 to 1");
  return make_unfolded(
      description, DoubleSphereModel(xi, alpha, plane_of(description)), "xi and alpha");
}

CameraPointer make_division(const CameraDescription& description) {
  expect_intrinsics(description, "fu fv pu pv");
  if (description.distortion_model != "none" && description.distortion_model != "division") {
    description.fail(fmt::format("distortion_model is {}, expected none for camera_model division",
                                 description.distortion_model));
  }
  const std::vector<double>& coeffs = description.distortion_coeffs;
  expect_num_coeffs(description, coeffs.size() == 1, "1 for camera_model division");
  return make_unfolded(
      description, DivisionModel(plane_of(description), coeffs[0]), "distortion_coeffs");
}

CameraPointer make_equirectangular(const CameraDescription& description) {
  if (!description.intrinsics.empty()) {
    description.fail(fmt::format("intrinsics has {} numbers, expected none for camera_model {}",
                                 description.intrinsics.size(),
                                 description.camera_model));
  }
  expect_no_distortion(description);
  const double height = 0.5 * description.width_px;
  if (std::abs(description.height_px - height) > kMaxAspectError * height) {
    description.fail(
        fmt::format("resolution is [{}, {}], expected twice the height as width for "
                    "camera_model {}: 360 by 180 degrees",
                    description.width_px,
                    description.height_px,
                    description.camera_model));
  }
  return std::make_shared<const EquirectangularCamera>(
      EquirectangularModel(description.width_px, description.height_px),
      description.width_px,
      description.height_px);
}

}  // namespace

bool CameraDescription::is_same(const CameraDescription& other) const {
  return camera_model == other.camera_model && intrinsics == other.intrinsics &&
         distortion_model == other.distortion_model &&
         distortion_coeffs == other.distortion_coeffs && width_px == other.width_px &&
         height_px == other.height_px;
}

void CameraDescription::fail(const std::string& what) const {
  // Names of models are what a file says: of whatever length, and maybe of several lines.
  std::string line = what.substr(0, kLongestMessage);
  std::replace_if(
      line.begin(), line.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; }, '?');
  throw InputError(where, line + (what.size() > kLongestMessage ? "..." : ""));
}

CameraRegistry CameraRegistry::with_builtin_models() {
  CameraRegistry registry;
  registry.add("pinhole", make_pinhole);
  registry.add("omni", make_omni);
  registry.add("eucm", make_eucm);
  registry.add("ds", make_ds);
  registry.add("division", make_division);
  registry.add("equirectangular", make_equirectangular);
  return registry;
}

void CameraRegistry::add(std::string name, CameraFactory factory) {
  WAYMARK_CHECK(!name.empty() && factory != nullptr);
  const bool is_new = factories_.emplace(std::move(name), std::move(factory)).second;
  WAYMARK_CHECK(is_new);
}

std::shared_ptr<const Camera> CameraRegistry::make_camera(
    const CameraDescription& description) const {
  const auto factory = factories_.find(description.camera_model);
  if (factory == factories_.end()) {
    description.fail(
        fmt::format("camera_model is {}, {}", description.camera_model, expected_models()));
  }
  expect_sound_numbers(description);
  std::shared_ptr<const Camera> camera = factory->second(description);
  WAYMARK_CHECK(camera != nullptr);
  return camera;
}

std::shared_ptr<const Camera> CameraRegistry::make_stored_camera(
    const CameraDescription& description) const {
  const std::string& model = description.camera_model;
  if (factories_.contains(model) || !is_name(model)) return make_camera(description);
  if (!is_name(description.distortion_model)) {
    description.fail(fmt::format("distortion_model is {}, expected the name of one",
                                 quote_for_message(description.distortion_model)));
  }
  expect_sound_numbers(description);
  return std::make_shared<const UnknownCamera>(description, expected_models());
}

std::string CameraRegistry::expected_models() const {
  std::vector<std::string> names;
  for (const auto& [name, unused] : factories_) names.push_back(name);
  return fmt::format("expected one of: {}", fmt::join(names, ", "));
}

void expect_intrinsics(const CameraDescription& description, std::string_view names) {
  std::istringstream stream{std::string(names)};
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  if (description.intrinsics.size() != words.size()) {
    description.fail(fmt::format("intrinsics has {} numbers, expected {}: {}",
                                 description.intrinsics.size(),
                                 words.size(),
                                 names));
  }
  for (std::size_t i = 0; i < words.size(); ++i) {
    const bool is_focal = words[i] == "fu" || words[i] == "fv";
    if (is_focal && !(description.intrinsics[i] > 0.0)) {
      description.fail(fmt::format(
          "focal length {} is {}, expected more than 0", words[i], description.intrinsics[i]));
    }
  }
}

void expect_no_distortion(const CameraDescription& description) {
  if (description.distortion_model != "none") {
    description.fail(fmt::format("distortion_model is {}, expected none for camera_model {}",
                                 description.distortion_model,
                                 description.camera_model));
  }
  expect_num_coeffs(description,
                    description.distortion_coeffs.empty(),
                    "none of them without a distortion_model");
}

}  // namespace waymark

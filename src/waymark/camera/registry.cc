// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/registry.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/camera/perspective.h"

namespace waymark {
namespace {

constexpr int kMinSizePx = 16;
constexpr int kMaxSizePx = 20000;
// Part of the image that a perspective camera may have beyond its field of view: extreme corners,
// where polynomials are least certain.
constexpr double kMaxInvalidPart = 0.05;

/// Part of the image's pixels that have no direction.
double invalid_part(const Camera& camera) {
  constexpr int kNumPerAxis = 40;
  std::vector<Eigen::Vector2d> pixels;
  for (int i = 0; i < kNumPerAxis * kNumPerAxis; ++i) {
    const double column = (i % kNumPerAxis + 0.5) / kNumPerAxis;
    const double row = (i / kNumPerAxis + 0.5) / kNumPerAxis;
    pixels.emplace_back(camera.width_px() * column - 0.5, camera.height_px() * row - 0.5);
  }
  std::vector<Eigen::Vector3d> bearings(pixels.size());
  std::vector<std::uint8_t> is_valid(pixels.size());
  camera.unproject(pixels, bearings, is_valid);
  const auto num_invalid = std::count(is_valid.begin(), is_valid.end(), 0);
  return static_cast<double>(num_invalid) / static_cast<double>(pixels.size());
}

std::shared_ptr<const Camera> make_pinhole(const CameraDescription& description) {
  expect_intrinsics(description, "fu fv pu pv");
  const std::vector<double>& coeffs = description.distortion_coeffs;
  if (description.distortion_model == "none") {
    expect_no_distortion(description);
  } else if (description.distortion_model != "radtan") {
    description.fail(fmt::format("distortion_model is {}, expected radtan or none",
                                 description.distortion_model));
  } else if (coeffs.size() != 4 && coeffs.size() != 5 && coeffs.size() != 8) {
    description.fail(
        fmt::format("distortion_coeffs has {} numbers, expected 4, 5 or 8 for radtan: k1 k2 p1 p2 "
                    "[k3 [k4 k5 k6]]",
                    coeffs.size()));
  }
  const std::vector<double>& intrinsics = description.intrinsics;
  const PerspectiveModel model(
      {intrinsics[0], intrinsics[1]}, {intrinsics[2], intrinsics[3]}, coeffs);
  auto camera =
      std::make_shared<const PerspectiveCamera>(model, description.width_px, description.height_px);
  if (const double part = invalid_part(*camera); part > kMaxInvalidPart) {
    const double end_px = model.focal_px().mean() * model.max_distorted_radius();
    description.fail(fmt::format(
        "distortion_coeffs fold the image back at {:.0f} px from the principal point, which leaves "
        "{:.0f} % of the pixels without a direction, expected at most {:.0f} %",
        end_px,
        100.0 * part,
        100.0 * kMaxInvalidPart));
  }
  return camera;
}

void expect_finite(const CameraDescription& description,
                   std::string_view name,
                   const std::vector<double>& values) {
  for (const double value : values) {
    if (!std::isfinite(value)) {
      description.fail(fmt::format("{} holds {}, expected finite numbers", name, value));
    }
  }
}

}  // namespace

void CameraDescription::fail(const std::string& what) const { throw InputError(where, what); }

CameraRegistry CameraRegistry::with_builtin_models() {
  CameraRegistry registry;
  registry.add("pinhole", make_pinhole);
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
    std::vector<std::string> names;
    for (const auto& [name, unused] : factories_) names.push_back(name);
    description.fail(fmt::format("camera_model is {}, expected one of: {}",
                                 description.camera_model,
                                 fmt::join(names, ", ")));
  }
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
  std::shared_ptr<const Camera> camera = factory->second(description);
  WAYMARK_CHECK(camera != nullptr);
  return camera;
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
  if (!description.distortion_coeffs.empty()) {
    description.fail(
        fmt::format("distortion_coeffs has {} numbers, expected none of them without a "
                    "distortion_model",
                    description.distortion_coeffs.size()));
  }
}

}  // namespace waymark

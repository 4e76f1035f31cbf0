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
#include "waymark/camera/builtin_models.h"

namespace waymark {
namespace {

constexpr int kMinSizePx = 16;
constexpr int kMaxSizePx = 20000;
constexpr std::size_t kLongestMessage = 1000;

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
  add_builtin_models(registry);
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

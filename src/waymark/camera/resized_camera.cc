// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/resized_camera.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

namespace waymark {
namespace {

constexpr std::array<std::string_view, 5> kWithPlane = {
    "pinhole", "omni", "eucm", "ds", "division"};

}  // namespace

bool has_image_plane(const CameraDescription& camera) {
  return camera.intrinsics.size() >= kNumPlaneIntrinsics &&
         std::ranges::find(kWithPlane, camera.camera_model) != kWithPlane.end();
}

std::optional<CameraDescription> resized(const CameraDescription& camera, double factor) {
  CameraDescription result = camera;
  result.width_px = static_cast<int>(factor * camera.width_px);
  result.height_px = static_cast<int>(factor * camera.height_px);
  if (has_image_plane(camera)) {
    double* const plane = &result.intrinsics[camera.intrinsics.size() - kNumPlaneIntrinsics];
    for (int i = 0; i < 2; ++i) plane[i] *= factor;
    // The corner is half a pixel before the centre of the first one.
    for (int i = 2; i < 4; ++i) plane[i] = factor * (plane[i] + 0.5) - 0.5;
  } else if (camera.camera_model != "equirectangular") {
    return std::nullopt;
  }
  return result;
}

std::optional<ChainCamera> resized(const ChainCamera& camera, double factor) {
  const auto description = resized(camera.description, factor);
  if (!description) return std::nullopt;
  ChainCamera result = camera;
  result.description = *description;
  std::vector<double>& sigmas = result.sigmas.intrinsics;
  if (sigmas.size() < kNumPlaneIntrinsics) return result;
  for (std::size_t i = sigmas.size() - kNumPlaneIntrinsics; i < sigmas.size(); ++i) {
    sigmas[i] *= factor;
  }
  return result;
}

}  // namespace waymark

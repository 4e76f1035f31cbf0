// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/calibration_advice.h"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>

#include "waymark/camera/resized_camera.h"

namespace waymark {
namespace {

/// Focal lengths relative to the width; a fisheye lens of 200 degrees has 0.3.
constexpr double kMinFocal = 0.1;
constexpr double kMaxFocal = 10.0;

/// Principal points lie this near to the middle of the image, relative to its size, unless it was
/// cut off; but then rarely by the same part of the width and the height.
constexpr double kMaxOffCentre = 0.2;
constexpr double kMaxUnequal = 0.1;

/// No pair that one device carries is longer.
constexpr double kMaxBaselineM = 5.0;

/// From 2 kHz to 0.2 Hz.
constexpr double kMinIntervalNs = 5e5;
constexpr double kMaxIntervalNs = 5e9;

double focal_length_px(const CameraDescription& camera) {
  return camera.intrinsics[camera.intrinsics.size() - kNumPlaneIntrinsics];
}

std::optional<std::string> advise_on_focal_length(const CameraDescription& camera) {
  const double focal_px = focal_length_px(camera);
  const double ratio = focal_px / camera.width_px;
  if (ratio >= kMinFocal && ratio <= kMaxFocal) return std::nullopt;
  return fmt::format(
      "a focal length of {:g} px is no likely one for images {} px wide: is it in pixels, rather "
      "than in {}?",
      focal_px,
      camera.width_px,
      ratio < 1.0 ? "millimetres" : "micrometres");
}

std::optional<std::string> advise_on_size(const CameraDescription& camera) {
  const double* const centre = &camera.intrinsics[camera.intrinsics.size() - 2];
  const double x = 2.0 * (centre[0] + 0.5) / camera.width_px;
  const double y = 2.0 * (centre[1] + 0.5) / camera.height_px;
  const double factor = 0.5 * (x + y);
  if (std::abs(factor - 1.0) < kMaxOffCentre || std::abs(x / y - 1.0) > kMaxUnequal) {
    return std::nullopt;
  }
  return fmt::format(
      "the principal point ({:g}, {:g}) is in the middle of images of about {:.0f}x{:.0f} px: are "
      "the intrinsics for another size? For {}x{} px multiply them by {:.3g}",
      centre[0],
      centre[1],
      factor * camera.width_px,
      factor * camera.height_px,
      camera.width_px,
      camera.height_px,
      1.0 / factor);
}

}  // namespace

std::vector<std::string> advise_on_numbers(const CameraChain& chain) {
  std::vector<std::string> advice;
  for (std::size_t i = 0; i < chain.cameras.size(); ++i) {
    const CameraDescription& camera = chain.cameras[i].description;
    if (!has_image_plane(camera)) continue;
    for (const auto& line : {advise_on_focal_length(camera), advise_on_size(camera)}) {
      if (line) advice.push_back(fmt::format("camera {}: {}", i, *line));
    }
  }
  if (chain.cameras.size() < 2) return advice;
  const double baseline_m = chain.cameras[1].cam_from_rig.translation.norm();
  if (baseline_m > kMaxBaselineM) {
    advice.push_back(
        fmt::format("camera 1 is {:g} m away from camera 0: is T_cn_cnm1 in millimetres? Expected "
                    "metres",
                    baseline_m));
  }
  return advice;
}

std::optional<std::string> advise_on_times(double interval_ns) {
  if (interval_ns > kMaxIntervalNs) {
    return fmt::format(
        "images are {:.4g} s apart: are the time stamps in milliseconds? Expected seconds",
        1e-9 * interval_ns);
  }
  if (interval_ns < kMinIntervalNs) {
    return fmt::format(
        "images are {:.4g} ns apart: are the time stamps in {}? Expected nanoseconds",
        interval_ns,
        interval_ns < 1e3 ? "milliseconds" : "microseconds");
  }
  return std::nullopt;
}

}  // namespace waymark

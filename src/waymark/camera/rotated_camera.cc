// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/rotated_camera.h"

#include <numbers>
#include <utility>

#include "waymark/camera/resized_camera.h"

namespace waymark {
namespace {

/// Clockwise by a quarter: pixel (u, v) goes to (height - 1 - v, u), and so do the axes, x' = -y
/// and y' = x.
void rotate_plane(CameraDescription& camera, CalibrationSigmas& sigmas) {
  const std::size_t first = camera.intrinsics.size() - kNumPlaneIntrinsics;
  double* const plane = &camera.intrinsics[first];
  std::swap(plane[0], plane[1]);
  const double pu = plane[2];
  plane[2] = camera.height_px - 1 - plane[3];
  plane[3] = pu;
  if (sigmas.intrinsics.size() == camera.intrinsics.size()) {
    std::swap(sigmas.intrinsics[first], sigmas.intrinsics[first + 1]);
    std::swap(sigmas.intrinsics[first + 2], sigmas.intrinsics[first + 3]);
  }
  std::swap(camera.width_px, camera.height_px);
  // Tangential distortion is r^2 p + 2 x (x p) with p = (p2, p1), which turns as x does (Brown
  // 1966).
  if (camera.distortion_model != "radtan" || camera.distortion_coeffs.size() < 4) return;
  double& p1 = camera.distortion_coeffs[2];
  double& p2 = camera.distortion_coeffs[3];
  const double old_p1 = p1;
  p1 = p2;
  p2 = -old_p1;
  if (sigmas.distortion_coeffs.size() >= 4) {
    std::swap(sigmas.distortion_coeffs[2], sigmas.distortion_coeffs[3]);
  }
}

}  // namespace

std::optional<ChainCamera> rotated(const ChainCamera& camera, int num_quarters) {
  ChainCamera result = camera;
  // Upside down, all directions are turned by half a turn about the axis.
  const bool is_whole_sphere = camera.description.camera_model == "equirectangular";
  if (is_whole_sphere ? num_quarters % 2 != 0 : !has_image_plane(camera.description)) {
    return std::nullopt;
  }
  for (int i = 0; i < num_quarters && !is_whole_sphere; ++i) {
    rotate_plane(result.description, result.sigmas);
  }
  if (num_quarters == 2) result.readout_s = -camera.readout_s;
  if (num_quarters % 2 == 1) result.readout_s = 0.0;
  const Eigen::Quaterniond turn(
      Eigen::AngleAxisd(0.5 * std::numbers::pi * num_quarters, Eigen::Vector3d::UnitZ()));
  const Rigid3 rotated_from_camera(turn, Eigen::Vector3d::Zero());
  result.cam_from_rig = rotated_from_camera * camera.cam_from_rig * rotated_from_camera.inverse();
  return result;
}

}  // namespace waymark

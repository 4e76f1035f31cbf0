// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/imu_camchain.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Core>

#include "waymark/base/text.h"

namespace waymark {
namespace {

/// The lines of a camera that say how the IMU is mounted to it.
std::string format_mounting(const ChainCamera& camera, const ImuCalibration& told) {
  std::string text;
  if (told.imu_from_rig) {
    const Eigen::Matrix4d cam_from_imu =
        (camera.cam_from_rig * told.imu_from_rig->inverse()).matrix().unaryExpr(&unsigned_zero);
    text += "  T_cam_imu:\n";
    for (int row = 0; row < 4; ++row) {
      text += fmt::format("  - [{}]\n", fmt::join(cam_from_imu.row(row), ", "));
    }
  }
  if (told.time_shift_s) text += fmt::format("  timeshift_cam_imu: {}\n", *told.time_shift_s);
  return text;
}

}  // namespace

std::string format_camchain_imu(const CameraChain& chain, const ImuCalibration& told) {
  std::string text = format_camchain(chain);
  for (std::size_t i = 0; i < chain.cameras.size(); ++i) {
    const std::string section = fmt::format("cam{}:\n", i);
    text.insert(text.find(section) + section.size(), format_mounting(chain.cameras[i], told));
  }
  return text;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/named_rigs.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <numbers>
#include <span>

#include "waymark/base/check.h"
#include "waymark/simulate/named_cameras.h"

namespace waymark {
namespace {

/// Where a camera is in the frame of camera 0, in metres, and where it looks: degrees to the right.
struct Mount {
  double right_m;
  double down_m;
  double ahead_m;
  double right_deg;
};

struct NamedRig {
  const char* name;
  const char* camera;
  std::span<const Mount> mounts;
};

constexpr std::array<Mount, 4> kSurround = {{{0.0, 0.0, 0.0, 0.0},
                                             {0.15, 0.0, -0.15, 90.0},
                                             {0.0, 0.0, -0.3, 180.0},
                                             {-0.15, 0.0, -0.15, -90.0}}};
constexpr std::array<Mount, 6> kCar = {{{0.0, 0.0, 0.0, 0.0},
                                        {0.8, 0.1, -0.6, 60.0},
                                        {-0.8, 0.1, -0.6, -60.0},
                                        {0.8, 0.1, -1.2, 120.0},
                                        {-0.8, 0.1, -1.2, -120.0},
                                        {0.0, 0.0, -1.8, 180.0}}};
constexpr std::array<Mount, 2> kBackToBack = {{{0.0, 0.0, 0.0, 0.0}, {0.0, 0.0, -0.03, 180.0}}};
constexpr std::array<Mount, 4> kHead = {{{0.0, 0.0, 0.0, 0.0},
                                         {0.11, 0.0, 0.0, 0.5},
                                         {0.14, 0.01, -0.03, 75.0},
                                         {-0.03, 0.01, -0.03, -75.0}}};

constexpr std::array<NamedRig, 4> kRigs = {{{"surround", "perspective", kSurround},
                                            {"car", "perspective", kCar},
                                            {"back_to_back", "fisheye_200", kBackToBack},
                                            {"head", "perspective", kHead}}};

Rigid3 cam_from_rig(const Mount& mount) {
  const double right_rad = mount.right_deg * std::numbers::pi / 180.0;
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(right_rad, Eigen::Vector3d::UnitY()));
  return Rigid3(rotation, {mount.right_m, mount.down_m, mount.ahead_m}).inverse();
}

}  // namespace

std::vector<std::string> rig_names() {
  std::vector<std::string> names;
  for (const NamedRig& rig : kRigs) names.push_back(rig.name);
  return names;
}

CameraChain named_rig(std::string_view name, int height_px) {
  for (const NamedRig& rig : kRigs) {
    if (name != rig.name) continue;
    CameraChain chain;
    for (const Mount& mount : rig.mounts) {
      chain.cameras.push_back({named_camera(rig.camera, height_px), cam_from_rig(mount)});
    }
    return chain;
  }
  throw InputError(fmt::format("rig '{}'", name),
                   fmt::format("is unknown, expected {}", fmt::join(rig_names(), ", ")));
}

}  // namespace waymark

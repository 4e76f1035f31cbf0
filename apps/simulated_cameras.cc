// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "simulated_cameras.h"

#include <fmt/format.h>

#include <optional>

#include "waymark/base/check.h"
#include "waymark/base/config.h"
#include "waymark/simulate/named_cameras.h"
#include "waymark/simulate/sequence.h"

namespace waymark {
namespace {

constexpr double kDepthFactor = 5000.0;
constexpr int kHeightPx = 480;

/// A moderately distorted camera; the second of a pair is neither parallel to the first nor like
/// it.
CameraDescription default_camera(int index) {
  CameraDescription camera;
  camera.camera_model = "pinhole";
  camera.intrinsics = {420.0 + index, 421.0 + index, 317.0 - 3.0 * index, 242.0 + 2.0 * index};
  camera.distortion_model = "radtan";
  camera.distortion_coeffs = {-0.2, 0.05, 0.0002, -0.0001};
  camera.width_px = 640;
  camera.height_px = 480;
  camera.where = "default camera";
  return camera;
}

Rigid3 default_cam1_from_cam0() {
  Vector6d motion;
  motion << -0.11, 0.002, -0.001, 0.008, -0.01, 0.005;
  return Rigid3::exp(motion);
}

CameraChain make_chain(Setup setup,
                       const CameraDescription& camera0,
                       const CameraDescription& camera1) {
  switch (setup) {
    case Setup::kMono:
      return mono_chain(camera0);
    case Setup::kStereo:
      return stereo_chain(camera0, camera1, default_cam1_from_cam0());
    case Setup::kRgbd:
      return rgbd_chain(camera0, kDepthFactor);
  }
  return {};
}

}  // namespace

CameraChain default_camera_chain(Setup setup) {
  return make_chain(setup, default_camera(0), default_camera(1));
}

CameraChain named_camera_chain(const std::string& name, Setup setup) {
  const CameraDescription camera = named_camera(name, kHeightPx);
  return make_chain(setup, camera, camera);
}

CameraChain read_camera_chain(const std::filesystem::path& file, Setup setup) {
  std::optional<CameraChain> chain = read_camchain(parse_config(ConfigSource::from_file(file)));
  const std::size_t num_cameras = setup == Setup::kStereo ? 2 : 1;
  if (!chain || chain->cameras.size() < num_cameras) {
    throw InputError(file.string(),
                     fmt::format("describes {} cameras, expected {} for {}",
                                 chain ? chain->cameras.size() : 0,
                                 num_cameras,
                                 to_string(setup)));
  }
  chain->cameras.resize(num_cameras);
  if (setup != Setup::kRgbd) chain->depth_factor.reset();
  if (setup == Setup::kRgbd && !chain->depth_factor) chain->depth_factor = kDepthFactor;
  return *chain;
}

}  // namespace waymark

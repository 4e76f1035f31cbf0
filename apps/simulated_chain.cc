// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "simulated_chain.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <numbers>
#include <optional>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/config.h"
#include "waymark/simulate/named_cameras.h"
#include "waymark/simulate/sequence.h"

namespace waymark {
namespace {

constexpr double kDepthFactor = 5000.0;

/// The camera unless others are given: moderately distorted; the second of a pair is neither
/// parallel to the first nor like it.
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

CameraChain default_camera_chain(Setup setup) {
  return make_chain(setup, default_camera(0), default_camera(1));
}

/// Of a named camera (simulate/named_cameras.h), 480 pixels high.
CameraChain named_camera_chain(const std::string& name, Setup setup) {
  const CameraDescription camera = named_camera(name, kSimulatedHeightPx);
  return make_chain(setup, camera, camera);
}

/// The part of a camchain file that a setup uses.
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

}  // namespace

CameraChain simulated_chain(const std::string& camera, Setup setup) {
  if (camera.empty()) return default_camera_chain(setup);
  const std::vector<std::string> names = camera_names();
  const bool is_named = std::ranges::find(names, camera) != names.end();
  return is_named ? named_camera_chain(camera, setup) : read_camera_chain(camera, setup);
}

/// Turns the second of a pair, where there is one, about its own axes.
void turn_camera1(const std::vector<double>& degrees, CameraChain& chain) {
  if (degrees.empty()) return;
  if (chain.cameras.size() < 2) {
    throw InputError("--turn", "there is one camera, expected a pair (--setup stereo)");
  }
  const double mrad_per_degree = 1e3 * std::numbers::pi / 180.0;
  const Eigen::Vector3d turn_mrad = mrad_per_degree * Eigen::Vector3d(degrees.data());
  chain = told_chain(std::move(chain), {.turn_mrad = turn_mrad});
}

}  // namespace waymark

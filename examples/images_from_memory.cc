// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Images that never were files: takes raw grey frames from standard input, as any program that has
// images in memory would hand them over, and prints what is known of each frame at once.
//
//   ffmpeg -v error -i walk.mp4 -f rawvideo -pix_fmt gray - |
//     waymark_example_images_from_memory CAMCHAIN.yaml FRAMES_PER_SECOND
//
// The image is borrowed for the call of feed() only, so that one buffer serves for all frames.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/config.h"
#include "waymark/camera/camchain.h"
#include "waymark/system/system.h"

namespace {

using namespace waymark;

void print(std::int64_t timestamp_ns, const TrackingResult& result) {
  std::printf("%.3f %s",
              1e-9 * static_cast<double>(timestamp_ns),
              std::string(to_string(result.state)).c_str());
  if (!result.world_from_rig) {  // There is no pose, but always a reason.
    std::printf(" %s\n", std::string(to_string(result.reason)).c_str());
    return;
  }
  const Eigen::Vector3d position_in_world = result.world_from_rig->translation;
  // The first three rows and columns are of the translation. A root of their trace is how far the
  // position may be off (one sigma) in the map around it, in the unit of the map.
  const double sigma = std::sqrt(result.covariance.topLeftCorner<3, 3>().trace());
  std::printf(" %.4f %.4f %.4f +- %.4f, %d landmarks\n",
              position_in_world.x(),
              position_in_world.y(),
              position_in_world.z(),
              sigma,
              result.num_inliers);
}

int map_stream(const char* camchain, double rate_hz) {
  const std::optional<CameraChain> chain =
      read_camchain(parse_config(ConfigSource::from_file(camchain)));
  if (!chain) throw InputError(camchain, "describes no camera, expected cam0");
  const Rig rig = make_rig(*chain);
  const int width_px = rig.cameras[0].camera->width_px();
  const int height_px = rig.cameras[0].camera->height_px();

  // For images that come from a camera now, kRealtime would never wait for the mapper.
  System system(rig, Settings(), Timing::kLockstep);

  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width_px * height_px));
  FrameImages frame;
  // An own image type needs no copy: a pointer, the size, and how far apart rows begin.
  frame.image0 = ImageView{pixels.data(), width_px, height_px, width_px};
  const auto interval_ns = static_cast<std::int64_t>(1e9 / rate_hz);
  const auto size = static_cast<std::streamsize>(pixels.size());
  while (std::cin.read(reinterpret_cast<char*>(pixels.data()), size)) {
    frame.timestamp_ns += interval_ns;  // Times must increase; use those of the camera.
    print(frame.timestamp_ns, system.feed(frame));
  }
  system.finish();
  std::printf("%zu frames have a pose\n", system.trajectory().size());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const double rate_hz = argc == 3 ? std::atof(argv[2]) : 0.0;
  if (!(rate_hz > 0.0)) {
    std::fprintf(stderr, "usage: %s CAMCHAIN.yaml FRAMES_PER_SECOND <RAW_GREY_FRAMES\n", argv[0]);
    return 2;
  }
  try {
    return map_stream(argv[1], rate_hz);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Finds images in a saved map, each by itself, and says why where it is not found.
//
//   waymark_example_localize_images MAP.wmap CAMCHAIN.yaml IMAGE...
//
// The camera may be another than that of the map, which stays as it is.
#include <cstdio>
#include <exception>
#include <optional>
#include <span>
#include <string>

#include "waymark/base/check.h"
#include "waymark/base/config.h"
#include "waymark/camera/camchain.h"
#include "waymark/input/decode.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/system/localizer.h"

namespace {

using namespace waymark;

void print(const char* image, const TrackingResult& result) {
  if (!result.world_from_rig) {
    // num_candidates places were compared; of the one that came closest:
    std::printf("%s: %s, best of %d places: %d of %d matches agree\n",
                image,
                std::string(to_string(result.reason)).c_str(),
                result.num_candidates,
                result.num_inliers,
                result.num_matches);
    return;
  }
  const Eigen::Vector3d position_in_world = result.world_from_rig->translation;
  const Eigen::Vector3d ahead_in_world =
      result.world_from_rig->rotation * Eigen::Vector3d::UnitZ();  // Cameras look along +z.
  std::printf("%s: at %.3f %.3f %.3f looking along %.2f %.2f %.2f, sub-map %u, %d landmarks\n",
              image,
              position_in_world.x(),
              position_in_world.y(),
              position_in_world.z(),
              ahead_in_world.x(),
              ahead_in_world.y(),
              ahead_in_world.z(),
              result.submap.value,
              result.num_inliers);
}

int localize(const char* map, const char* camchain, std::span<char*> images) {
  const std::optional<CameraChain> chain =
      read_camchain(parse_config(ConfigSource::from_file(camchain)));
  if (!chain) throw InputError(camchain, "describes no camera, expected cam0");

  Localizer localizer(make_rig(*chain), Settings(), load_map(map).map);
  int num_found = 0;
  for (const char* path : images) {
    const std::optional<Image> image = read_grey_image(path);
    if (!image) throw InputError(path, "is missing or no image, expected png, jpg or the like");
    FrameImages frame;
    frame.image0 = image->view();
    // For a stream track() is better, which looks near the frame before first.
    const TrackingResult result = localizer.locate(frame);
    print(path, result);
    num_found += result.world_from_rig.has_value();
  }
  std::printf("%d of %zu found\n", num_found, images.size());
  return num_found > 0 ? 0 : 3;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: %s MAP.wmap CAMCHAIN.yaml IMAGE...\n", argv[0]);
    return 2;
  }
  try {
    return localize(argv[1], argv[2], std::span(argv + 3, static_cast<std::size_t>(argc - 3)));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}

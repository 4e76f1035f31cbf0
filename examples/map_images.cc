// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// The smallest useful program: maps a folder of images of one camera and prints where the camera
// was.
//
//   waymark_example_map_images FOLDER CAMCHAIN.yaml
//
// A Rig describes the cameras, Settings everything else, and a System maps what it is fed, frame by
// frame. feed() says at once what is known of the frame; trajectory() says it better at the end.
#include <cstdint>
#include <cstdio>
#include <exception>
#include <optional>

#include "waymark/base/config.h"
#include "waymark/camera/camchain.h"
#include "waymark/input/decode.h"
#include "waymark/input/listing.h"
#include "waymark/system/system.h"

namespace {

constexpr std::int64_t kFrameIntervalNs = 50'000'000;

int map_images(const char* folder, const char* camchain) {
  using namespace waymark;

  const std::optional<CameraChain> chain =
      read_camchain(parse_config(ConfigSource::from_file(camchain)));
  if (!chain) throw InputError(camchain, "describes no camera, expected cam0");

  // kLockstep maps in a thread of its own and still gives the same bits in every run.
  System system(make_rig(*chain), Settings(), Timing::kLockstep);

  FrameImages frame;
  for (const std::filesystem::path& path : list_images(folder)) {
    frame.timestamp_ns += kFrameIntervalNs;
    const std::optional<Image> image = read_grey_image(path);
    if (!image) continue;          // An image that cannot be read is a gap, no more.
    frame.image0 = image->view();  // Borrowed for the call only.
    const TrackingResult result = system.feed(frame);
    std::fprintf(stderr,
                 "%s: %s, %d landmarks seen\n",
                 path.filename().c_str(),
                 std::string(to_string(result.state)).c_str(),
                 result.num_inliers);
  }
  system.finish();

  // world_from_rig is where the rig (here the camera) was and how it stood; the unit of length is
  // free, as one camera cannot know it.
  for (const TrajectoryFrame& pose : system.trajectory()) {
    const Eigen::Vector3d& position_in_world = pose.world_from_rig.translation;
    std::printf("%.3f %.6f %.6f %.6f\n",
                1e-9 * static_cast<double>(pose.timestamp_ns),
                position_in_world.x(),
                position_in_world.y(),
                position_in_world.z());
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: %s FOLDER CAMCHAIN.yaml\n", argv[0]);
    return 2;
  }
  try {
    return map_images(argv[1], argv[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}

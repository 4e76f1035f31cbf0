// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Follows a session while it runs: the pose of each frame as soon as it is there, and every change
// of the map, as a viewer or a planner would.
//
//   waymark_example_follow_map INPUT [CAMCHAIN.yaml]
//
// There are no callbacks: after each feed() the caller asks for what it wants. map() gives the
// newest map, which nobody changes any more, so that it can be handed to other threads; as long as
// the pointer is the same, nothing has changed.
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>

#include "waymark/base/check.h"
#include "waymark/base/config.h"
#include "waymark/camera/camchain.h"
#include "waymark/input/input.h"
#include "waymark/system/system.h"

namespace {

using namespace waymark;

/// What differs between two maps. Parts that both share are passed over, so that it takes time
/// proportional to what was edited.
void print_changes(const Map& before, const Map& now) {
  int num_new = 0, num_moved = 0, num_gone = 0;
  now.keyframes().for_each_difference(
      before.keyframes(), [&](KeyframeId, const Keyframe* was, const Keyframe* is) {
        num_new += is && !was;
        num_gone += !is && was;
        num_moved += is && was && is->rig_from_world.translation != was->rig_from_world.translation;
      });
  std::printf("map: %zu keyframes (%d new, %d moved, %d gone), %zu landmarks, %zu loops\n",
              now.keyframes().size(),
              num_new,
              num_moved,
              num_gone,
              now.landmarks().size(),
              now.loop_edges().size());
}

/// A pose that is kept by reference moves with the map when that is corrected.
void print_pose(const Map& map, const TrackingResult& result, const RelativePose& pose) {
  // The keyframe that it refers to may be on its way to the mapper still: then as it was found.
  const bool is_mapped = pose.reference.is_valid() && pose.reference < map.keyframes().end_id();
  Rigid3 rig_from_world = result.world_from_rig->inverse();
  if (is_mapped) {
    rig_from_world =
        map.rig_from_world(pose.reference, pose.rig_from_reference, pose.reference_scale);
  }
  const Eigen::Vector3d position_in_world = rig_from_world.origin_in_source();
  std::printf("frame %u at %.4f %.4f %.4f\n",
              result.frame.value,
              position_in_world.x(),
              position_in_world.y(),
              position_in_world.z());
}

int follow(const char* path, const char* camchain) {
  InputOptions options;
  if (camchain) {
    options.calibration = read_camchain(parse_config(ConfigSource::from_file(camchain)));
  }
  const std::unique_ptr<Input> input = open_input(path, options);
  if (!input->info().calibration) throw InputError(path, "carries no calibration");
  System system(make_rig(*input->info().calibration), Settings(), Timing::kLockstep);

  std::shared_ptr<const Map> map = system.map();
  while (const std::optional<InputFrame> images = input->next()) {
    if (images->fault != FrameFault::kNone) continue;
    FrameImages frame;
    frame.timestamp_ns = images->timestamp_ns;
    frame.image0 = images->images[0].view();
    if (images->images.size() > 1) frame.image1 = images->images[1].view();
    if (images->depth) frame.depth = images->depth->view();
    const TrackingResult result = system.feed(frame);

    if (system.map() != map) {
      print_changes(*map, *system.map());
      map = system.map();
    }
    if (result.world_from_rig) print_pose(*map, result, result.pose);
  }
  system.finish();
  print_changes(*map, *system.map());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3) {
    std::fprintf(stderr, "usage: %s INPUT [CAMCHAIN.yaml]\n", argv[0]);
    return 2;
  }
  try {
    return follow(argv[1], argc == 3 ? argv[2] : nullptr);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}

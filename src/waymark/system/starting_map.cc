// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/starting_map.h"

#include <algorithm>
#include <cstdint>

#include "waymark/base/check.h"

namespace waymark {

FrameId frame_after(const Map* map) {
  constexpr std::uint32_t kMaxFrame = UINT32_MAX / 2;
  FrameId after{0};
  if (!map) return after;
  map->keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    after = std::max(after, FrameId{keyframe.frame.value + 1});
    if (keyframe.frame.value > kMaxFrame) {
      throw InputError("map", "the numbers of its frames leave none for more");
    }
  });
  return after;
}

void check_has_scale(const Map& map) {
  if (!is_metric(map)) {
    throw InputError("map", "its scale is free, expected images of one camera without depth");
  }
}

void check_cameras(const Map& map) {
  map.keyframes().for_each([](KeyframeId, const Keyframe& keyframe) {
    for (const RigCamera& camera : keyframe.rig().cameras) {
      if (!camera.camera->can_project()) camera.camera->project({}, {}, {});
    }
  });
}

}  // namespace waymark

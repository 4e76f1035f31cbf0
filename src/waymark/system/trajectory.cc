// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/trajectory.h"

#include <cstdint>

#include "waymark/track/last_frame.h"

namespace waymark {

std::vector<TrajectoryFrame> list_poses(const TrajectoryMemory& memory, const Map& map) {
  std::vector<TrajectoryFrame> frames;
  frames.reserve(memory.entries().size());
  for (std::uint32_t i = 0; i < memory.entries().size(); ++i) {
    const TrajectoryMemory::Entry& entry = memory.entries()[i];
    if (entry.state != FrameState::kTracked && entry.state != FrameState::kFilled) continue;
    const auto [reference, scale, rig_from_reference] = entry.pose();
    // The newest frames may refer to a keyframe that this map does not contain yet.
    if (reference >= map.keyframes().end_id()) continue;
    const Rigid3 rig_from_world = map.rig_from_world(reference, rig_from_reference, scale);
    const KeyframeId living = map.resolve(reference);
    frames.push_back({FrameId{i},
                      entry.timestamp_ns,
                      entry.state,
                      map.keyframes().at(living).submap,
                      rig_from_world.inverse()});
  }
  return frames;
}

std::vector<FrameState> list_states(const TrajectoryMemory& memory) {
  std::vector<FrameState> states;
  for (const TrajectoryMemory::Entry& entry : memory.entries()) states.push_back(entry.state);
  return states;
}

std::vector<std::pair<KeyframeId, RigMotion>> list_motions(const TrajectoryMemory& memory,
                                                           const Map& map) {
  std::vector<std::pair<KeyframeId, RigMotion>> motions;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (keyframe.frame < memory.first()) return;
    auto motion = memory.motion_in(keyframe.frame, map);
    if (!motion) return;
    motion->inverse_range = median_inverse_range(map, keyframe.rig_from_world, keyframe.landmarks);
    motions.emplace_back(id, *motion);
  });
  return motions;
}

}  // namespace waymark

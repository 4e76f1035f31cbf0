// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/trajectory_memory.h"

#include <utility>

namespace waymark {

void TrajectoryMemory::add(const Frame& frame, const TrackOutcome& outcome, const Map& map) {
  RelativePose pose = outcome.pose.value_or(RelativePose{});
  // A keyframe is its own reference, so that it moves as the map moves it.
  if (outcome.keyframe) pose = {*outcome.keyframe, Rigid3{}, pose.reference_scale};
  entries_.push_back({frame.timestamp_ns, outcome.state, pose});
  if (!outcome.seen.empty()) unsettled_.push_back({frame.id, outcome.seen, nullptr});
  for (const FilledPose& filled : outcome.filled) {
    Entry& entry = entries_.at(filled.frame.value);
    entry.state = FrameState::kFilled;
    entry.pose = filled.pose;
    unsettled_.push_back({filled.frame, {}, filled.features});
  }
  while (unsettled_.size() > kMaxUnsettled) {
    settle(unsettled_.front(), map);
    unsettled_.pop_front();
  }
}

void TrajectoryMemory::settle(const Map& map) {
  for (const Unsettled& unsettled : unsettled_) settle(unsettled, map);
  unsettled_.clear();
}

void TrajectoryMemory::settle(const Unsettled& unsettled, const Map& map) {
  RelativePose& pose = entries_.at(unsettled.frame.value).pose;
  const KeyframeId living = map.resolve(pose.reference);
  const Keyframe& keyframe = map.keyframes().at(living);
  if (keyframe.frame == unsettled.frame) return;  // Adjusted with the map.
  const Rigid3 guess =
      map.rig_from_world(pose.reference, pose.rig_from_reference, pose.reference_scale);
  const auto refined =
      unsettled.features
          ? refiner_.refine(map, refiner_.find(map, living, *unsettled.features, guess), guess)
          : refiner_.refine(map, unsettled.seen, guess);
  if (!refined) return;
  pose = {living, *refined * keyframe.rig_from_world.inverse(), keyframe.applied_scale};
}

}  // namespace waymark

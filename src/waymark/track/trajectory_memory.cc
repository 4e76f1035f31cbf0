// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/trajectory_memory.h"

namespace waymark {
namespace {

// What a frame saw is found in the map as long as it may have been merged meanwhile.
static_assert(Map::kRemembersMerged >= TrajectoryMemory::kMaxUnsettled);

bool has_pose(const TrajectoryMemory::Entry& entry) {
  return entry.state == FrameState::kTracked || entry.state == FrameState::kFilled;
}

}  // namespace

void TrajectoryMemory::add(const Frame& frame, const TrackOutcome& outcome, const Map& map) {
  entries_.push_back({frame.timestamp_ns, outcome.state, outcome.details.pose});
  if (outcome.message) newest_sent_ = frame.id;
  // Long after the map has changed last it has settled, and the frame with it.
  const bool is_settled = frame.id.value - newest_sent_.value > kMaxSinceKeyframe;
  if (!outcome.seen.empty() && !is_settled) unsettled_.push_back({frame.id, outcome.seen, nullptr});
  if (outcome.state != FrameState::kTracked) unposed_.push_back({frame.id, frame.features});
  if (unposed_.size() > kMaxUnposed) unposed_.pop_front();
  for (const FilledPose& filled : outcome.details.filled) {
    Entry& entry = entry_of(filled.frame);
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
  for (auto it = unposed_.rbegin(); it != unposed_.rend(); ++it) fill(*it, 1, map);
  for (const Unposed& unposed : unposed_) fill(unposed, -1, map);
  unposed_.clear();
}

void TrajectoryMemory::settle(const Unsettled& unsettled, const Map& map) {
  RelativePose& pose = entry_of(unsettled.frame).pose;
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
  pose = {living, keyframe.applied_scale, *refined * keyframe.rig_from_world.inverse()};
}

void TrajectoryMemory::fill(const Unposed& unposed, int step, const Map& map) {
  Entry& entry = entry_of(unposed.frame);
  const std::int64_t neighbour =
      std::int64_t{unposed.frame.value} - std::int64_t{first_.value} + step;
  if (has_pose(entry) || neighbour < 0 || neighbour >= std::ssize(entries_)) return;
  const Entry& known = entries_[static_cast<std::size_t>(neighbour)];
  if (!has_pose(known)) return;
  const KeyframeId living = map.resolve(known.pose.reference);
  const Keyframe& keyframe = map.keyframes().at(living);
  const Rigid3 near = *rig_from_world(neighbour, keyframe.submap, map);
  // The motion between the two frames beyond goes on.
  const auto beyond = rig_from_world(neighbour + step, keyframe.submap, map);
  const Rigid3 guess = beyond ? near * beyond->inverse() * near : near;
  const auto seen = refiner_.find(map, living, *unposed.features, guess);
  const auto found = refiner_.refine(map, seen, guess);
  if (!found) return;
  entry.state = FrameState::kFilled;
  entry.pose = {living, keyframe.applied_scale, *found * keyframe.rig_from_world.inverse()};
}

std::optional<Rigid3> TrajectoryMemory::rig_from_world(std::int64_t index,
                                                       SubmapId submap,
                                                       const Map& map) const {
  if (index < 0 || index >= std::ssize(entries_)) return std::nullopt;
  const Entry& entry = entries_[static_cast<std::size_t>(index)];
  if (!has_pose(entry)) return std::nullopt;
  const RelativePose& pose = entry.pose;
  if (map.keyframes().at(map.resolve(pose.reference)).submap != submap) return std::nullopt;
  return map.rig_from_world(pose.reference, pose.rig_from_reference, pose.reference_scale);
}

}  // namespace waymark

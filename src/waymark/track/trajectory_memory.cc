// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/trajectory_memory.h"

#include "waymark/track/pose_check.h"

namespace waymark {
namespace {

// What a frame saw is found in the map as long as it may have been merged meanwhile.
static_assert(Map::kRemembersMerged >= TrajectoryMemory::kMaxUnsettled);

bool has_pose(const TrajectoryMemory::Entry& entry) {
  return entry.state == FrameState::kTracked || entry.state == FrameState::kFilled;
}

}  // namespace

TrajectoryMemory::Entry::Entry(std::int64_t time_ns, FrameState state_in, const RelativePose& pose)
    : timestamp_ns(time_ns), state(state_in) {
  set_pose(pose);
}

RelativePose TrajectoryMemory::Entry::pose() const {
  const Rigid3 rig_from_reference(Eigen::Quaterniond(rotation_.data()),
                                  Eigen::Map<const Eigen::Vector3d>(translation_.data()));
  return {reference_, reference_scale_, rig_from_reference};
}

void TrajectoryMemory::Entry::set_pose(const RelativePose& pose) {
  reference_ = pose.reference;
  reference_scale_ = pose.reference_scale;
  Eigen::Map<Eigen::Quaterniond>(rotation_.data()) = pose.rig_from_reference.rotation;
  Eigen::Map<Eigen::Vector3d>(translation_.data()) = pose.rig_from_reference.translation;
}

void TrajectoryMemory::add(const Frame& frame, const TrackingResult& result, const Map& map) {
  entries_.emplace_back(frame.timestamp_ns, result.state, result.pose);
  entries_.back().is_reckoned = result.state == FrameState::kFilled;
  if (result.is_keyframe) newest_sent_ = frame.id;
  num_relocalizations_ += result.is_relocalized;
  // Long after the map has changed last it has settled, and the frame with it.
  const bool is_settled = frame.id.value - newest_sent_.value > kMaxSinceKeyframe;
  if (!result.landmarks.empty() && !is_settled) {
    const Features& features = *result.features;
    unsettled_.push_back({frame.id,
                          seen_landmarks(features, result.landmarks),
                          nullptr,
                          features.readout_s[0],
                          features.inverse_depth_offset,
                          frame.turn_rad_s});
  }
  if (result.state != FrameState::kTracked) unposed_.push_back({frame.id, frame.features});
  if (unposed_.size() > kMaxUnposed) unposed_.pop_front();
  for (const FilledPose& filled : result.filled) {
    Entry& entry = entry_of(filled.frame);
    entry.state = FrameState::kFilled;
    entry.is_reckoned = false;
    entry.set_pose(filled.pose);
    unsettled_.push_back({filled.frame,
                          {},
                          filled.features,
                          filled.features->readout_s[0],
                          filled.features->inverse_depth_offset});
  }
  while (unsettled_.size() > kMaxUnsettled) {
    settle(unsettled_.front(), *frame.features->rig, map);
    unsettled_.pop_front();
  }
}

void TrajectoryMemory::settle(const Rig& rig, const Map& map) {
  for (const Unsettled& unsettled : unsettled_) settle(unsettled, rig, map);
  for (auto it = unposed_.rbegin(); it != unposed_.rend(); ++it) fill(*it, 1, rig, map);
  for (const Unposed& unposed : unposed_) fill(unposed, -1, rig, map);
  unposed_.clear();
}

void TrajectoryMemory::settle(const Unsettled& unsettled, const Rig& rig, const Map& map) {
  Entry& entry = entry_of(unsettled.frame);
  const RelativePose pose = entry.pose();
  const KeyframeId living = map.resolve(pose.reference);
  const Keyframe& keyframe = map.keyframes().at(living);
  if (keyframe.frame == unsettled.frame) return;  // Adjusted with the map.
  const Rigid3 guess =
      map.rig_from_world(pose.reference, pose.rig_from_reference, pose.reference_scale);
  std::vector<SeenLandmark> seen = unsettled.features
                                       ? refiner_.find(rig, map, living, *unsettled.features, guess)
                                       : unsettled.seen;
  const float readout_s = static_cast<float>(rig.cameras[0].readout_s) - unsettled.readout_s;
  if (auto motion = readout_s == 0.0f ? std::nullopt : motion_in(unsettled.frame, map)) {
    if (unsettled.turn_rad_s) motion->turn_rad_s = *unsettled.turn_rad_s;
    seen = refiner_.seen_at_once(rig, map, seen, guess, *motion, readout_s);
  }
  const float offset =
      static_cast<float>(rig.inverse_depth_offset) - unsettled.inverse_depth_offset;
  for (SeenLandmark& one : seen) one.inverse_depth -= offset;
  const auto refined = refiner_.refine(rig, map, seen, guess);
  if (!refined) return;
  entry.set_pose({living, keyframe.applied_scale, *refined * keyframe.rig_from_world.inverse()});
}

std::optional<RigMotion> TrajectoryMemory::motion_in(FrameId frame, const Map& map) const {
  const std::int64_t index = std::int64_t{frame.value} - std::int64_t{first_.value};
  if (index < 0 || index >= std::ssize(entries_)) return std::nullopt;
  const Entry& entry = entries_[static_cast<std::size_t>(index)];
  if (!has_pose(entry)) return std::nullopt;
  const SubmapId submap = map.keyframes().at(map.resolve(entry.pose().reference)).submap;
  std::int64_t from = index, to = index;
  if (rig_from_world(index - 1, submap, map)) --from;
  if (rig_from_world(index + 1, submap, map)) ++to;
  if (from == to) return std::nullopt;
  const Rigid3 motion =
      *rig_from_world(to, submap, map) * rig_from_world(from, submap, map)->inverse();
  const auto time_ns = [&](std::int64_t i) {
    return entries_[static_cast<std::size_t>(i)].timestamp_ns;
  };
  const double seconds = 1e-9 * static_cast<double>(time_ns(to) - time_ns(from));
  const Vector6d rate = motion.log() / seconds;
  return RigMotion{rate.tail<3>().cast<float>(), rate.head<3>().cast<float>()};
}

void TrajectoryMemory::fill(const Unposed& unposed, int step, const Rig& rig, const Map& map) {
  Entry& entry = entry_of(unposed.frame);
  const std::int64_t neighbour =
      std::int64_t{unposed.frame.value} - std::int64_t{first_.value} + step;
  if (entry.is_seen() || neighbour < 0 || neighbour >= std::ssize(entries_)) return;
  const Entry& known = entries_[static_cast<std::size_t>(neighbour)];
  if (!known.is_seen()) return;
  const KeyframeId living = map.resolve(known.pose().reference);
  const Keyframe& keyframe = map.keyframes().at(living);
  const Rigid3 near = *rig_from_world(neighbour, keyframe.submap, map);
  // The motion between the two frames beyond goes on.
  const auto beyond = rig_from_world(neighbour + step, keyframe.submap, map);
  const Rigid3 guess = beyond ? near * beyond->inverse() * near : near;
  const auto seen = refiner_.find(rig, map, living, *unposed.features, guess);
  const auto found = refiner_.refine(rig, map, seen, guess);
  if (!found) return;
  const auto alike = locator_.find_alike(*unposed.features, keyframe);
  const double part = part_in_place(*unposed.features, map, alike, *found);
  if (part < PoseCheck::kMinPartInPlace) return;
  entry.state = FrameState::kFilled;
  entry.is_reckoned = false;
  entry.set_pose({living, keyframe.applied_scale, *found * keyframe.rig_from_world.inverse()});
}

void TrajectoryMemory::set_inertial_pose(std::int64_t index,
                                         std::int64_t beside,
                                         const Rigid3& rig_from_world,
                                         const Map& map) {
  const KeyframeId living =
      map.resolve(entries_[static_cast<std::size_t>(beside)].pose().reference);
  const Keyframe& keyframe = map.keyframes().at(living);
  Entry& entry = entries_[static_cast<std::size_t>(index)];
  if (!entry.is_seen()) {
    entry.state = FrameState::kFilled;
    entry.is_reckoned = true;
  }
  entry.set_pose(
      {living, keyframe.applied_scale, rig_from_world * keyframe.rig_from_world.inverse()});
}

std::optional<Rigid3> TrajectoryMemory::rig_from_world(std::int64_t index,
                                                       SubmapId submap,
                                                       const Map& map) const {
  if (index < 0 || index >= std::ssize(entries_)) return std::nullopt;
  const Entry& entry = entries_[static_cast<std::size_t>(index)];
  if (!has_pose(entry)) return std::nullopt;
  const RelativePose pose = entry.pose();
  if (map.keyframes().at(map.resolve(pose.reference)).submap != submap) return std::nullopt;
  return map.rig_from_world(pose.reference, pose.rig_from_reference, pose.reference_scale);
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/trajectory_layer.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace waymark {
namespace {

struct Pose {
  Rigid3 world_from_rig;
  SubmapId submap;
};

bool is_known(KeyframeId id, const Map& map) { return id < map.keyframes().end_id(); }

std::optional<Pose> pose_of(const FrameNote& note, const Map& map) {
  if (note.final_pose) return Pose{*note.final_pose, note.submap};
  if (!note.pose || !is_known(note.pose->reference, map)) return std::nullopt;
  const Keyframe* keyframe = map.keyframes().find(map.resolve(note.pose->reference));
  if (!keyframe) return std::nullopt;
  const Rigid3 rig_from_world = map.rig_from_world(
      note.pose->reference, note.pose->rig_from_reference, note.pose->reference_scale);
  return Pose{rig_from_world.inverse(), keyframe->submap};
}

bool moves_frames(const Keyframe& before, const Keyframe& after) {
  return before.rig_from_world.translation != after.rig_from_world.translation ||
         before.rig_from_world.rotation.coeffs() != after.rig_from_world.rotation.coeffs() ||
         before.applied_scale != after.applied_scale || before.submap != after.submap;
}

}  // namespace

void TrajectoryLayer::reset() { *this = TrajectoryLayer(); }

void TrajectoryLayer::take(const FrameNote& note) {
  if (notes_.empty()) start_ns_ = note.timestamp_ns;
  const auto place = std::lower_bound(
      notes_.begin(), notes_.end(), note, [](const FrameNote& a, const FrameNote& b) {
        return a.frame < b.frame;
      });
  const auto index = static_cast<std::uint32_t>(place - notes_.begin());
  if (place == notes_.end()) {
    notes_.push_back(note);
  } else if (place->frame == note.frame) {
    // What is known better now is the pose; the time stays.
    const float tracking_ms = std::max(note.tracking_ms, place->tracking_ms);
    *place = note;
    place->tracking_ms = tracking_ms;
  } else {
    return;  // Frames come in order.
  }
  changed_.push_back(index);
  pending_.push_back(index);
}

void TrajectoryLayer::file(std::uint32_t index, const Map& map) {
  const FrameNote& note = notes_[index];
  if (!note.pose || note.final_pose) return;
  if (!is_known(note.pose->reference, map)) {
    pending_.push_back(index);
    return;
  }
  const KeyframeId living = map.resolve(note.pose->reference);
  if (!living.is_valid()) return;
  followers_.resize(std::max<std::size_t>(followers_.size(), living.value + 1));
  followers_[living.value].push_back(index);
  changed_.push_back(index);
}

void TrajectoryLayer::follow_keyframes(const Map& before, const Map& after) {
  after.keyframes().for_each_difference(
      before.keyframes(), [&](KeyframeId id, const Keyframe* old, const Keyframe* now) {
        if (!old || id.value >= followers_.size()) return;
        std::vector<std::uint32_t>& followers = followers_[id.value];
        if (!now) {
          pending_.insert(pending_.end(), followers.begin(), followers.end());
          followers = {};
        } else if (moves_frames(*old, *now)) {
          changed_.insert(changed_.end(), followers.begin(), followers.end());
        }
      });
}

void TrajectoryLayer::advance(std::span<const FrameNote> notes,
                              const Map& before,
                              const Map& after,
                              std::vector<Message>& messages) {
  for (const FrameNote& note : notes) take(note);
  follow_keyframes(before, after);
  for (const std::uint32_t index : std::exchange(pending_, {})) file(index, after);
  std::sort(changed_.begin(), changed_.end());
  changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
  for_each_chunk<std::uint32_t>(changed_,
                                [&](auto indices) { messages.push_back(encode(indices, after)); });
  changed_.clear();
}

void TrajectoryLayer::snapshot(const Map& map, std::vector<Message>& messages) const {
  std::vector<std::uint32_t> all;
  for (std::uint32_t i = 0; i < notes_.size(); ++i) all.push_back(i);
  for_each_chunk<std::uint32_t>(all,
                                [&](auto indices) { messages.push_back(encode(indices, map)); });
}

Message TrajectoryLayer::encode(std::span<const std::uint32_t> indices, const Map& map) const {
  MessageWriter writer(MessageKind::kTrajectory, indices.size());
  std::vector<Pose> poses;
  const Rigid3 unknown(Eigen::Quaterniond(NAN, NAN, NAN, NAN), Eigen::Vector3d::Constant(NAN));
  for (const std::uint32_t index : indices) {
    poses.push_back(pose_of(notes_[index], map).value_or(Pose{unknown, SubmapId{}}));
  }
  for (const std::uint32_t index : indices) writer.add(notes_[index].frame.value);
  for (const Pose& pose : poses) writer.add(pose.world_from_rig.translation);
  for (const Pose& pose : poses) writer.add(pose.world_from_rig.rotation);
  for (const std::uint32_t index : indices) {
    writer.add(
        static_cast<float>(1e-9 * static_cast<double>(notes_[index].timestamp_ns - start_ns_)));
  }
  for (const std::uint32_t index : indices) writer.add(notes_[index].tracking_ms);
  for (const Pose& pose : poses) writer.add(saturate16(pose.submap.value));
  for (const std::uint32_t index : indices) {
    writer.add(static_cast<std::uint8_t>(notes_[index].state));
  }
  for (const std::uint32_t index : indices) {
    writer.add(static_cast<std::uint8_t>(notes_[index].reason));
  }
  return writer.finish();
}

}  // namespace waymark

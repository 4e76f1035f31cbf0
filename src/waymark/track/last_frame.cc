// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/last_frame.h"

#include "waymark/base/median.h"

namespace waymark {

float median_inverse_range(const Map& map,
                           const Rigid3& rig_from_world,
                           std::span<const LandmarkId> landmarks) {
  std::vector<float> inverse;
  for (const LandmarkId id : landmarks) {
    const Landmark* const landmark = id.is_valid() ? map.landmarks().find(id) : nullptr;
    if (!landmark) continue;
    const double distance = (rig_from_world * landmark->position_in_world).norm();
    inverse.push_back(static_cast<float>(1.0 / distance));
  }
  return inverse.empty() ? 0.0f : median(inverse);
}

void LastFrame::set(const Frame& frame,
                    const RelativePose& pose,
                    const Rigid3& rig_from_world,
                    std::span<const LandmarkId> landmarks) {
  pose_ = pose;
  features_ = frame.features;
  image_ = frame.image;
  landmarks_.assign(landmarks.begin(), landmarks.end());
  motion_.update(frame.timestamp_ns, rig_from_world);
}

RigMotion LastFrame::predict_motion(const Map& map) const {
  RigMotion motion = motion_.mean_motion();
  if (motion != RigMotion{}) {
    motion.inverse_range = median_inverse_range(map, motion_.pose(), landmarks_);
  }
  return motion;
}

RigMotion LastFrame::motion_in(const Map& map,
                               const Frame& frame,
                               const Rigid3& rig_from_world,
                               std::span<const LandmarkId> landmarks) const {
  MotionModel model = motion_;
  model.update(frame.timestamp_ns, rig_from_world);
  RigMotion motion = model.last_motion();
  if (frame.turn_rad_s) motion.turn_rad_s = *frame.turn_rad_s;
  motion.inverse_range = median_inverse_range(map, rig_from_world, landmarks);
  return motion;
}

void LastFrame::carry_over(const Map& map) {
  if (landmarks_.empty()) landmarks_ = map.keyframes().at(pose_.reference).landmarks;
  for (LandmarkId& id : landmarks_) id = map.resolve(id);
  motion_.move_last(
      map.rig_from_world(pose_.reference, pose_.rig_from_reference, pose_.reference_scale),
      map.scale_since(pose_.reference, pose_.reference_scale));
}

void LastFrame::forget_missing(const Map& before, const Map& after, KeyframeId other) {
  for (LandmarkId& id : landmarks_) {
    if (!after.landmarks().contains(id)) id = LandmarkId{};
  }
  if (!has_pose() || after.keyframes().contains(pose_.reference)) return;
  const Rigid3 rig_from_world =
      before.rig_from_world(pose_.reference, pose_.rig_from_reference, pose_.reference_scale);
  pose_ = RelativePose{};
  if (!other.is_valid()) return;
  const Keyframe& reference = after.keyframes().at(other);
  pose_ = {other, reference.applied_scale, rig_from_world * reference.rig_from_world.inverse()};
}

const LandmarkSet& LastFrame::landmarks(const Map& map) {
  set_.clear();
  for (std::uint32_t i = 0; i < features_->num_primary; ++i) {
    if (!landmarks_[i].is_valid()) continue;
    set_.add(landmarks_[i], map.landmarks().at(landmarks_[i]));
    set_.descriptors.back() = features_->descriptors[i];
  }
  return set_;
}

}  // namespace waymark

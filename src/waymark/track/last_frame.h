// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "waymark/geometry/rigid3.h"
#include "waymark/map/map.h"
#include "waymark/map/messages.h"
#include "waymark/match/landmark_set.h"
#include "waymark/track/frame.h"

namespace waymark {

/// Predicts the next pose: the motion between the last two frames goes on at the same speed.
class MotionModel {
 public:
  void reset() { has_velocity_ = false, has_pose_ = false; }

  void update(std::int64_t timestamp_ns, const Rigid3& rig_from_world) {
    const bool has_turn_before = has_velocity_;
    has_velocity_ = has_pose_ && timestamp_ns > timestamp_ns_;
    if (has_velocity_) {
      const double before_s = seconds_;
      const Eigen::Vector3d turn_before = motion_.tail<3>() / before_s;
      seconds_ = 1e-9 * static_cast<double>(timestamp_ns - timestamp_ns_);
      motion_ = (rig_from_world * rig_from_world_.inverse()).log();
      turn_change_.setZero();
      if (has_turn_before) {
        turn_change_ = (motion_.tail<3>() / seconds_ - turn_before) / (0.5 * (seconds_ + before_s));
      }
    }
    timestamp_ns_ = timestamp_ns;
    rig_from_world_ = rig_from_world;
    has_pose_ = true;
  }

  /// The same pose in a map that was corrected since, whose lengths were multiplied by scale.
  void move_last(const Rigid3& rig_from_world, double scale) {
    rig_from_world_ = rig_from_world;
    motion_.head<3>() *= scale;
  }

  /// Motion between the last two poses, without what is seen; 0 where it is not known.
  RigMotion mean_motion() const {
    if (!has_velocity_) return {};
    const Eigen::Vector<float, 6> rate = (motion_ / seconds_).cast<float>();
    return {rate.tail<3>(), rate.head<3>()};
  }
  /// The same at the last of them: hands turn faster and slower within frames.
  RigMotion last_motion() const {
    RigMotion motion = mean_motion();
    motion.turn_rad_s += (0.5 * seconds_ * turn_change_).cast<float>();
    return motion;
  }

  const Rigid3& pose() const { return rig_from_world_; }
  std::int64_t timestamp_ns() const { return timestamp_ns_; }

  /// turn: since the last pose, where a gyroscope tells it; else that goes on, too.
  Rigid3 predict(std::int64_t timestamp_ns,
                 const std::optional<Eigen::Quaterniond>& turn = {}) const {
    Rigid3 predicted = rig_from_world_;
    if (has_velocity_) {
      const double seconds = 1e-9 * static_cast<double>(timestamp_ns - timestamp_ns_);
      predicted = Rigid3::exp(motion_ * (seconds / seconds_)) * rig_from_world_;
    }
    if (!turn) return predicted;
    const Eigen::Quaterniond rotation = *turn * rig_from_world_.rotation;
    return {rotation, -(rotation * predicted.origin_in_source())};
  }

 private:
  bool has_pose_ = false;
  bool has_velocity_ = false;
  std::int64_t timestamp_ns_ = 0;
  double seconds_ = 0.0;
  Rigid3 rig_from_world_;
  Vector6d motion_ = Vector6d::Zero();
  Eigen::Vector3d turn_change_ = Eigen::Vector3d::Zero();  ///< In rad/s^2.
};

/// Median of the inverse distances of landmarks from a rig; 0 without any. Of ids that live.
float median_inverse_range(const Map& map,
                           const Rigid3& rig_from_world,
                           std::span<const LandmarkId> landmarks);

/// The newest frame that has a pose: what the next one is looked for from. Keeps its buffers.
class LastFrame {
 public:
  /// False before the first frame, and where forget_missing() left nothing to refer to.
  bool has_pose() const { return pose_.reference.is_valid(); }
  /// The keyframe that its pose refers to.
  KeyframeId reference() const { return pose_.reference; }

  /// landmarks: per feature; empty for a frame that begins a sub-map, whose landmarks have no ids
  /// yet.
  void set(const Frame& frame,
           const RelativePose& pose,
           const Rigid3& rig_from_world,
           std::span<const LandmarkId> landmarks);

  /// The next frame does not go on with the motion.
  void forget_motion() { motion_.reset(); }

  /// Reads pose and landmarks in a map that may have changed since.
  void carry_over(const Map& map);

  /// From one map to another that may lack what is newest: forgets landmarks that are gone, and
  /// where its reference is gone, refers to another keyframe (invalid: to none).
  void forget_missing(const Map& before, const Map& after, KeyframeId other);

  /// Its image; null where there is none.
  const SmallImage* image() const { return image_.get(); }

  /// Its pose; after carry_over() in the map of that.
  const Rigid3& rig_from_world() const { return motion_.pose(); }
  /// Its time, where it has a pose.
  std::int64_t timestamp_ns() const { return motion_.timestamp_ns(); }
  /// Pose of a frame at this time if the motion goes on; turn: by a gyroscope, if any.
  Rigid3 predict(std::int64_t timestamp_ns,
                 const std::optional<Eigen::Quaterniond>& turn = {}) const {
    return motion_.predict(timestamp_ns, turn);
  }

  /// How the rig moves in the next frame if it goes on as before; 0 where that is not known. Were
  /// the change of the turn to go on, too, errors of poses would come back larger in each frame.
  RigMotion predict_motion(const Map& map) const;
  /// How it moves in the next frame, whose pose and landmarks are known.
  RigMotion motion_in(const Map& map,
                      const Frame& frame,
                      const Rigid3& rig_from_world,
                      std::span<const LandmarkId> landmarks) const;

  /// Its landmarks with the looks that they had in it; after carry_over().
  const LandmarkSet& landmarks(const Map& map);

 private:
  RelativePose pose_;
  std::shared_ptr<const Features> features_;
  std::shared_ptr<const SmallImage> image_;
  std::vector<LandmarkId> landmarks_;  ///< Per feature.
  MotionModel motion_;
  LandmarkSet set_;
};

}  // namespace waymark

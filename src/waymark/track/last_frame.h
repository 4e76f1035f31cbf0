// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/match/landmark_set.h"
#include "waymark/track/frame.h"
#include "waymark/track/messages.h"
#include "waymark/track/motion_model.h"

namespace waymark {

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

  /// Pose of a frame at this time if the motion goes on.
  Rigid3 predict(std::int64_t timestamp_ns) const { return motion_.predict(timestamp_ns); }

  /// Its landmarks with the looks that they had in it; after carry_over().
  const LandmarkSet& landmarks(const Map& map);

 private:
  RelativePose pose_;
  std::shared_ptr<const Features> features_;
  std::vector<LandmarkId> landmarks_;  ///< Per feature.
  MotionModel motion_;
  LandmarkSet set_;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "waymark/imu/inertial_start.h"
#include "waymark/system/inertial_smoother.h"
#include "waymark/system/system.h"
#include "waymark/track/frame.h"

namespace waymark {

/// Goes on where nothing is seen by what the IMU measures, from the newest frame that has a pose.
class DeadReckoning {
 public:
  /// frames: those with a pose so far, in one part of the map, the newest of which it begins at.
  DeadReckoning(const InertialKnowledge& known, std::span<const TrajectoryFrame> frames);

  /// When it begins, by the clock of the images.
  std::int64_t begin_ns() const { return begin_ns_; }

  /// How the rig moved since it begins; nothing where samples are missing, and where that is not
  /// sure enough to look for the map from there.
  std::optional<ReckonedPose> to(const InertialKnowledge& known, std::int64_t timestamp_ns) const;

 private:
  std::int64_t begin_ns_;
  double time_shift_s_ = 0.0;
  InertialSetup setup_;
  std::optional<InertialEstimate> first_;
};

}  // namespace waymark

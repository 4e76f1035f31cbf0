// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "waymark/geometry/rigid3.h"

namespace waymark {

/// Predicts the next pose: the motion between the last two frames goes on at the same speed.
class MotionModel {
 public:
  void reset() { has_velocity_ = false, has_pose_ = false; }

  void update(std::int64_t timestamp_ns, const Rigid3& rig_from_world) {
    has_velocity_ = has_pose_ && timestamp_ns > timestamp_ns_;
    if (has_velocity_) {
      seconds_ = 1e-9 * static_cast<double>(timestamp_ns - timestamp_ns_);
      motion_ = (rig_from_world * rig_from_world_.inverse()).log();
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

  Rigid3 predict(std::int64_t timestamp_ns) const {
    if (!has_velocity_) return rig_from_world_;
    const double seconds = 1e-9 * static_cast<double>(timestamp_ns - timestamp_ns_);
    return Rigid3::exp(motion_ * (seconds / seconds_)) * rig_from_world_;
  }

 private:
  bool has_pose_ = false;
  bool has_velocity_ = false;
  std::int64_t timestamp_ns_ = 0;
  double seconds_ = 0.0;
  Rigid3 rig_from_world_;
  Vector6d motion_ = Vector6d::Zero();
};

}  // namespace waymark

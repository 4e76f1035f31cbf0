// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "waymark/base/id.h"
#include "waymark/features/features.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/marker/marker.h"

namespace waymark {

struct SmallImage;

/// How the rig moved since the newest frame that has a pose, by what an IMU measured.
struct ReckonedPose {
  Rigid3 rig_from_rig_then;                ///< In metres (map units for mono).
  Matrix6d covariance = Matrix6d::Zero();  ///< As of TrackingResult.
};

/// A frame on its way through the tracker.
struct Frame {
  FrameId id;
  std::int64_t timestamp_ns = 0;
  std::shared_ptr<const Features> features;
  std::shared_ptr<const SmallImage> image = nullptr;  ///< Of camera 0; null where there is none.
  /// Looks for markers in its image, which takes its time; empty where none are looked for.
  std::function<MarkerObservations()> find_markers = nullptr;
  /// How the rig turned since the newest frame that has a pose, by a gyroscope: rig_from_rig_then.
  std::optional<Eigen::Quaterniond> turn = std::nullopt;
  bool is_at_rest = false;  ///< By what an IMU measured for a while.
  /// How it turns within the frame by a gyroscope, as RigMotion has it.
  std::optional<Eigen::Vector3f> turn_rad_s = std::nullopt;
  /// Whether a gyroscope contradicts that the rig turned so since a moment (rig_from_rig_then), as
  /// long as its bias, where that is not known, is no larger (rad/s). Empty where there is none.
  std::function<bool(
      std::int64_t begin_ns, const Eigen::Quaterniond& rig_from_rig_then, double largest_bias)>
      contradicts_turn = nullptr;
  /// Asked where it is not found by its motion; nothing where an IMU does not tell it well enough,
  /// empty where there is none.
  std::function<std::optional<ReckonedPose>()> dead_reckon = nullptr;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "waymark/base/frame_state.h"
#include "waymark/camera/rig.h"
#include "waymark/features/features.h"
#include "waymark/map/map.h"
#include "waymark/track/frame_locator.h"
#include "waymark/track/options.h"

namespace waymark {

/// How far a frame was located from another pose: the turn in rad, and the way by the median
/// distance of what it sees, added up.
double distance_from(const Rigid3& other, const Map& map, const LocatedFrame& located);

/// The part, 0 to 1, of what looks alike wherever it is in the image that also lies where a pose
/// has it; 1 where nothing is alike. alike: per feature, of FrameLocator::find_alike().
double part_in_place(const Features& features,
                     const Map& map,
                     std::span<const LandmarkId> alike,
                     const Rigid3& rig_from_world);

/// How far features are from where a pose has their landmarks, in pixels of their level: the median
/// along each axis of the image. Of ids that live; 0 without any.
Eigen::Vector2f median_offset_px(const Features& features,
                                 const Map& map,
                                 std::span<const LandmarkId> landmarks,
                                 const Rigid3& rig_from_world);

/// Verifies the poses that are found for a frame. Near a wrong guess things that repeat agree on a
/// wrong pose, and that ruins the map. So a pose is verified where the motion led there, where most
/// of what looks alike without doubt is in place, or where two searches end.
class PoseCheck {
 public:
  /// Of part_in_place(), where nothing else speaks for a pose.
  static constexpr double kMinPartInPlace = 2.0 / 3.0;

  explicit PoseCheck(const PoseCheckOptions& options = {}) : options_(options) {}

  /// Begins with another frame; predicted: its pose if the motion goes on, if that is known.
  void begin(const std::optional<Rigid3>& predicted);

  /// Asked once for each search that found a pose. features: of the images alone.
  bool is_verified(const Features& features,
                   const Map& map,
                   const LocatedFrame& located,
                   FrameLocator& locator);

  /// Of the last pose of this frame that was not verified; nothing where there is none.
  const std::optional<FrameStatus>& refusal() const { return refusal_; }

 private:
  const PoseCheckOptions options_;
  std::optional<Rigid3> predicted_;
  std::vector<Rigid3> rejected_;
  std::optional<FrameStatus> refusal_;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "waymark/track/pose_refiner.h"
#include "waymark/track/tracker.h"

namespace waymark {

/// What is remembered of every frame: its state, its pose relative to a keyframe, and, until the
/// map around it has settled, what it saw. Of that the newest kMaxUnsettled frames at most, so that
/// memory per frame stays small in sessions of any length.
class TrajectoryMemory {
 public:
  static constexpr std::size_t kMaxUnsettled = 2000;

  struct Entry {
    std::int64_t timestamp_ns = 0;
    FrameState state = FrameState::kLost;
    RelativePose pose;  ///< Where state is kTracked or kFilled.
  };

  explicit TrajectoryMemory(std::shared_ptr<const Rig> rig) : refiner_(std::move(rig)) {}

  /// Adds the next frame; map is the one it was tracked in.
  void add(const Frame& frame, const TrackOutcome& outcome, const Map& map);
  /// Finds the poses of all unsettled frames again in the final map.
  void settle(const Map& map);

  const std::vector<Entry>& entries() const { return entries_; }

 private:
  /// What a frame without a keyframe's place in the map saw.
  struct Unsettled {
    FrameId frame;
    std::vector<SeenLandmark> seen;            ///< Of a tracked frame.
    std::shared_ptr<const Features> features;  ///< Of a frame filled in later.
  };

  void settle(const Unsettled& unsettled, const Map& map);

  std::vector<Entry> entries_;
  std::deque<Unsettled> unsettled_;
  PoseRefiner refiner_;
};

}  // namespace waymark

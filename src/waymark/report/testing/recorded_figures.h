// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "waymark/results/results.h"

namespace waymark {

/// What a run that went well leaves: so many frames, 20 per second, of which all are tracked.
inline FrameTable good_table(std::uint32_t num_frames = 400) {
  FrameTable table;
  table.stages = {"features", "wait"};
  for (std::uint32_t i = 0; i < num_frames; ++i) {
    FrameRecord frame;
    frame.index = i;
    frame.timestamp_ns = 1'000'000'000 + std::int64_t{50'000'000} * i;
    frame.state = FrameState::kTracked;
    frame.num_matches = 220;
    frame.num_inliers = 200;
    frame.num_features = 1000;
    frame.picture = {120, 50, 28, true};
    frame.is_keyframe = i % 20 == 0;
    frame.submap = SubmapId{0};
    frame.set_stages(std::array{4.0, 1.0});
    table.frames.push_back(frame);
  }
  return table;
}

/// The summary of the same.
inline RunSummary good_summary(const FrameTable& table) {
  RunSummary summary;
  summary.counts = count_frames(table.frames);
  for (const FrameRecord& frame : table.frames) {
    const bool has_pose = frame.state == FrameState::kTracked || frame.state == FrameState::kFilled;
    summary.num_trajectory_lines += has_pose;
  }
  summary.keyframes = 20;
  summary.landmarks = 3000;
  summary.submaps = 1;
  summary.setup = "mono";
  summary.timing = "lockstep";
  summary.version = "0.1.0";
  summary.quality = RunQuality{0.6, 0.08, 0.9, 12.0, false};
  summary.mistakes.emplace();
  return summary;
}

/// Frames from first on, up to last, have no pose.
inline void lose(FrameTable& table,
                 std::uint32_t first,
                 std::uint32_t last,
                 FrameReason reason = FrameReason::kTooFewMatches,
                 FrameState state = FrameState::kLost) {
  for (std::uint32_t i = first; i < last; ++i) {
    FrameRecord& frame = table.frames[i];
    frame.state = state;
    frame.reason = reason;
    frame.num_inliers = 5;
    frame.is_keyframe = false;
    frame.submap = SubmapId{};
  }
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "waymark/results/results.h"
#include "waymark/results/trajectory.h"
#include "waymark/session/frame_pipeline.h"
#include "waymark/system/system.h"

namespace waymark {

/// Hears of each frame once it is done. warning: what is wrong with a file of it, for people;
/// empty: nothing.
using FrameObserver = std::function<void(const FrameRecord&, const std::string& warning)>;

/// The rows of all frames, and which of them were fed: fed[i] is the row of the i-th one.
struct FedFrames {
  FrameTable table;
  std::vector<std::uint32_t> fed;
  std::vector<float> tracking_ms;
  /// What the input or the feeding of a frame threw, which ended it all; null if nothing.
  std::exception_ptr failure;
};

/// After a reset: what was fed before belongs to no map.
void forget_session(FedFrames& frames);

/// Feeds an input until it ends or should_stop() says so. Frames with a fault are not fed, but have
/// their row. What is thrown once a frame was fed ends it, and comes with the frames; before that,
/// it comes through.
FedFrames feed_all(Input& input,
                   const std::function<TrackingResult(const FrameImages&)>& feed,
                   const std::function<bool()>& should_stop,
                   const FrameObserver& observer,
                   const EarlyStages& stages = {});

using SubmapTrajectory = std::pair<SubmapId, std::vector<StampedPose>>;

/// The frames of each sub-map, most frames first, the older sub-map where they tie.
std::vector<SubmapTrajectory> split_by_submap(
    const std::vector<std::pair<SubmapId, StampedPose>>& frames);

/// What was used since its construction.
class UsageMeter {
 public:
  UsageMeter();
  void write_to(RunSummary& summary) const;

 private:
  std::chrono::steady_clock::time_point start_;
  double cpu_start_s_;
};

}  // namespace waymark

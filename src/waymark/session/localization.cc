// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/localization.h"

#include <utility>
#include <vector>

namespace waymark {

SessionResults localize_input(Input& input,
                              Localizer& localizer,
                              ImageOrder order,
                              const std::function<bool()>& should_stop,
                              const FrameObserver& observer) {
  const UsageMeter usage;
  std::vector<std::pair<SubmapId, StampedPose>> poses;
  const auto feed = [&](const FrameImages& frame) {
    const TrackingResult result =
        order == ImageOrder::kStream ? localizer.track(frame) : localizer.locate(frame);
    if (result.world_from_rig) {
      poses.push_back({result.submap, {frame.timestamp_ns, *result.world_from_rig}});
    }
    return result;
  };
  FedFrames frames = feed_all(input, feed, should_stop, observer);

  SessionResults results;
  const Map& map = localizer.map();
  RunSummary& summary = results.summary;
  summary.counts = count_frames(frames.table.frames);
  summary.localized = poses.size();
  summary.keyframes = map.keyframes().size();
  summary.landmarks = map.landmarks().size();
  for (const Submap& submap : map.submaps()) summary.submaps += !submap.joined_into.is_valid();
  summary.tracking_ms = summarize_times(frames.tracking_ms);
  summary.stages_ms = summarize_stages(frames.table);
  add_trajectories(map, poses, results);
  results.table = std::move(frames.table);
  usage.write_to(summary);
  return results;
}

}  // namespace waymark

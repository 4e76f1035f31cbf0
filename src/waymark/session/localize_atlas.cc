// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/localize_atlas.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace waymark {

SessionResults localize_in_atlas(Input& input,
                                 AtlasLocalizer& localizer,
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
  RunSummary& summary = results.summary;
  summary.counts = count_frames(frames.table.frames);
  summary.localized = poses.size();
  for (const AtlasTile& tile : localizer.atlas().contents().tiles) {
    summary.keyframes += tile.num_keyframes;
    summary.landmarks += tile.num_landmarks;
    summary.submaps = std::max<std::size_t>(summary.submaps, tile.frame + 1);
  }
  summary.tracking_ms = summarize_times({frames.tracking_ms.begin(), frames.tracking_ms.end()});
  summary.stages_ms = summarize_stages(frames.table);
  add_trajectories(Map(), poses, results);
  results.table = std::move(frames.table);
  results.failure = frames.failure;
  usage.write_to(summary);
  return results;
}

}  // namespace waymark

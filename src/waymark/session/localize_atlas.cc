// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/localize_atlas.h"

#include <algorithm>

namespace waymark {

SessionResults localize_in_atlas(Input& input,
                                 AtlasLocalizer& localizer,
                                 ImageOrder order,
                                 const std::function<bool()>& should_stop,
                                 const FrameObserver& observer) {
  const auto locate = [&](const FrameImages& frame) {
    return order == ImageOrder::kStream ? localizer.track(frame) : localizer.locate(frame);
  };
  SessionResults results = locate_all(input, locate, Map(), should_stop, observer);
  RunSummary& summary = results.summary;
  for (const AtlasTile& tile : localizer.atlas().contents().tiles) {
    summary.keyframes += tile.num_keyframes;
    summary.landmarks += tile.num_landmarks;
    summary.submaps = std::max<std::size_t>(summary.submaps, tile.frame + 1);
  }
  return results;
}

}  // namespace waymark

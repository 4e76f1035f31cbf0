// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "waymark/base/frame_state.h"
#include "waymark/map/map.h"
#include "waymark/place/place_index.h"
#include "waymark/track/frame.h"
#include "waymark/track/place_locator.h"
#include "waymark/track/settings.h"

namespace waymark {

/// Where the rig was just before: the keyframe that its pose referred to, and the pose. A place
/// within half of the median distance of what is seen from there needs no confidence.
struct LastPlace {
  KeyframeId keyframe;
  Rigid3 rig_from_world;
};

/// Where a marker says that the rig is.
struct MarkerPose {
  SubmapId submap;
  Rigid3 rig_from_world;
  Eigen::Vector3d marker_in_world;
};

/// Finds frames of which nothing is known in the map: similar places from the index, the first of
/// which that shows what the frame shows is the answer. The cost is bounded whatever the size of
/// the map, and misses are preferred to wrong places. Keeps its buffers.
class Relocalizer {
 public:
  Relocalizer(const TrackingSettings& settings, std::uint64_t seed)
      : options_(settings.options.relocalization),
        locator_(seed, options_),
        min_inliers_(settings.min_inliers) {}

  /// Pose of a frame in whichever sub-map shows the place. The index may know more or fewer
  /// keyframes than the map.
  std::optional<LocatedFrame> locate(const Frame& frame,
                                     const Map& map,
                                     const PlaceIndex& places,
                                     const std::optional<LastPlace>& last = {});

  /// The same with the keyframes to compare given, the likeliest first.
  std::optional<LocatedFrame> locate_among(const Frame& frame,
                                           const Map& map,
                                           std::span<const KeyframeId> candidates,
                                           const std::optional<LastPlace>& last = {});

  /// Where the markers that the frame shows are known in the map, the pose by one of them: of the
  /// two that each leaves open the one that what else is seen agrees with.
  std::optional<LocatedFrame> locate_at_markers(const Frame& frame, const Map& map);

  /// What became of the last search, of the place that came closest or was found; the reason is
  /// kNoCandidate or PlaceAttempt::failure.
  const FrameStatus& diagnosis() const { return diagnosis_; }

 private:
  void note(const PlaceAttempt& attempt);
  std::optional<LocatedFrame> locate_at(const Frame& frame, const Map& map, const MarkerPose& pose);

  const PlaceOptions options_;
  PlaceLocator locator_;
  int min_inliers_;
  FrameStatus diagnosis_;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "waymark/map/map.h"

namespace waymark {

/// The ids that the mapper will give to what was sent to it: consecutive ones, after those of the
/// map that it goes on in.
class PredictedIds {
 public:
  PredictedIds() = default;
  /// newest_frame: the one that became a keyframe last, if any did.
  explicit PredictedIds(const Map& map, FrameId newest_frame = {})
      : num_keyframes_(map.keyframes().end_id().value),
        num_submaps_(static_cast<std::uint32_t>(map.submaps().size())),
        newest_frame_(newest_frame) {}

  /// frame: that becomes the keyframe.
  KeyframeId add_keyframe(FrameId frame) {
    newest_frame_ = frame;
    return KeyframeId{num_keyframes_++};
  }

  /// frame: the newest that becomes a keyframe of it.
  SubmapId add_submap(std::size_t num_keyframes, FrameId frame) {
    newest_frame_ = frame;
    submap_start_ = num_keyframes_;
    num_keyframes_ += static_cast<std::uint32_t>(num_keyframes);
    return SubmapId{num_submaps_++};
  }

  /// The first keyframe of the newest sub-map that was sent.
  KeyframeId submap_start() const { return KeyframeId{submap_start_}; }
  KeyframeId newest_keyframe() const { return KeyframeId{num_keyframes_ - 1}; }
  /// The one that became a keyframe last.
  FrameId newest_frame() const { return newest_frame_; }

  /// Keyframes of the newest sub-map (without one: all) that a map has had so far.
  std::size_t submap_age(const Map& map) const {
    return map.keyframes().end_id().value - submap_start_;
  }
  /// Keyframes that a map does not contain yet.
  std::size_t num_pending(const Map& map) const {
    return num_keyframes_ - map.keyframes().end_id().value;
  }

 private:
  std::uint32_t num_keyframes_ = 0;
  std::uint32_t num_submaps_ = 0;
  std::uint32_t submap_start_ = 0;
  FrameId newest_frame_;
};

}  // namespace waymark

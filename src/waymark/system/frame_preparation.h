// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

#include "waymark/features/frame_builder.h"
#include "waymark/system/feature_prefetch.h"
#include "waymark/system/marker_finder.h"
#include "waymark/system/settings.h"
#include "waymark/track/frame.h"
#include "waymark/track/tracking_result.h"

namespace waymark {

/// Makes frames for the tracker of the images of a session: features, some of them prefetched by
/// other threads, by the cameras as calibrated so far, kept free of what moves along with these.
class FramePreparation {
 public:
  /// num_threads: that prefetch features; 0: none.
  FramePreparation(std::shared_ptr<const Rig> rig, const Settings& settings, unsigned num_threads);

  /// The cameras as calibrated so far.
  const std::shared_ptr<const Rig>& rig() const { return builder_.rig(); }
  /// From the next frame on.
  void set_calibration(std::shared_ptr<const Rig> rig);

  /// See System::prepare().
  void prepare(const FrameImages& images, std::shared_ptr<const void> owner) {
    prefetch_.prepare(images, std::move(owner));
  }
  std::size_t max_prepared() const { return prefetch_.capacity(); }

  /// The next frame, and in the result what is known of it. motion(): how the rig should move,
  /// asked for where that matters.
  Frame make_frame(FrameId id,
                   const FrameImages& images,
                   const std::function<RigMotion()>& motion,
                   TrackingResult& result);

  /// Looks for what moves along in a frame that was tracked.
  void watch(ImageView image0, TrackingResult& result);
  /// What was found: see FrameBuilder.
  const Image& ego_mask() const { return builder_.ego_mask(); }

  const MarkerFinder& markers() const { return marker_finder_; }

 private:
  std::shared_ptr<const Features> build(const FrameImages& images,
                                        const std::function<RigMotion()>& motion,
                                        StageTimes& times);

  FrameBuilder builder_;
  FeaturePrefetch prefetch_;
  const MarkerFinder marker_finder_;
  SubmapId watched_submap_;  ///< Of the last frame with a pose.
};

}  // namespace waymark

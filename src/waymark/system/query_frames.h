// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "waymark/camera/rig.h"
#include "waymark/features/frame_builder.h"
#include "waymark/map/map.h"
#include "waymark/system/marker_finder.h"
#include "waymark/system/settings.h"
#include "waymark/system/system.h"
#include "waymark/track/frame.h"

namespace waymark {

/// The angle in radians that a pixel of a map's middling camera covers; 0 for a map of nothing.
double middling_pixel_angle(const Map& map);

/// Makes frames of images that are to be found in a map. Images that are finer than the map's are
/// reduced until a pixel covers the angle of one of the map's: finer details are not in it, and
/// would take up the features.
class QueryFrames {
 public:
  /// map_pixel_angle: see middling_pixel_angle(). uses_range: whether ranges count, which they do
  /// in metres only.
  QueryFrames(Rig rig, const Settings& settings, double map_pixel_angle, bool uses_range);

  /// The cameras of the reduced images, as calibrated by now.
  const std::shared_ptr<const Rig>& rig() const { return builder_.rig(); }
  /// Those of the images as they are given.
  Rig full_rig() const;
  /// From the next frame on the reduced images are of this rig.
  void set_calibration(std::shared_ptr<const Rig> rig) { builder_.set_calibration(std::move(rig)); }

  bool needs_motion(const FrameImages& images) const { return builder_.needs_motion(images); }
  /// A frame by itself, and in the result what is known of it.
  Frame build(const FrameImages& images, TrackingResult& result) {
    return build(images, {}, result);
  }
  /// The next one of a stream. motion: see Tracker::predict_motion. InputError where its time stamp
  /// is not later than that of the one before.
  Frame build_next(const FrameImages& images, const RigMotion& motion, TrackingResult& result);

 private:
  Frame build(const FrameImages& images, const RigMotion& motion, TrackingResult& result);
  std::shared_ptr<const Features> find_features(const FrameImages& images, const RigMotion& motion);

  const std::shared_ptr<const Rig> full_rig_;
  const double reduction_;
  const bool uses_range_;
  FrameBuilder builder_;
  const MarkerFinder marker_finder_;
  std::uint32_t num_frames_ = 0;
  std::optional<std::int64_t> last_timestamp_ns_;  ///< Of the stream.
};

}  // namespace waymark

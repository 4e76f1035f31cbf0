// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/base/settings.h"
#include "waymark/track/options.h"

namespace waymark {

/// Pose of each frame.
struct TrackingSettings {
  int min_inliers = 20;                ///< Landmarks that a pose must rest on.
  double keyframe_ratio = 0.55;        ///< Of the landmarks of the reference keyframe.
  double keyframe_parallax_px = 60.0;  ///< Median against the reference keyframe.
  int max_keyframe_interval = 30;      ///< In frames.
  TrackingOptions options = {};        ///< Constants, for experiments.

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("min_inliers",
          self.min_inliers,
          SettingInfo{.low = 8, .high = 500, .help = "Landmarks a pose must rest on."});
    field("keyframe_ratio",
          self.keyframe_ratio,
          SettingInfo{.low = 0.1,
                      .high = 1.0,
                      .help = "A new keyframe is due when a frame sees less than this part of the "
                              "established landmarks that its reference keyframe sees."});
    field("keyframe_parallax_px",
          self.keyframe_parallax_px,
          SettingInfo{.low = 1.0,
                      .high = 1000.0,
                      .unit = "px",
                      .help = "Median parallax against the reference keyframe that makes a new "
                              "keyframe worth its cost."});
    field("max_keyframe_interval",
          self.max_keyframe_interval,
          SettingInfo{.low = 1,
                      .high = 1000,
                      .unit = "frames",
                      .help = "Longest time between keyframes while the camera moves."});
  }
};

}  // namespace waymark

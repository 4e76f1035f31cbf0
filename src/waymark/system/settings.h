// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "waymark/image/frame_builder.h"
#include "waymark/mapping/settings.h"
#include "waymark/track/settings.h"

namespace waymark {

/// All settings of the engine, one section per module. Cameras are read separately (camchain).
struct Settings {
  int seed = 0;
  int map_latency = 2;
  FeatureSettings features;
  StereoSettings stereo;
  DepthSettings depth;
  ViewSettings view;
  TrackingSettings tracking;
  MappingSettings mapping;

  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("seed",
          self.seed,
          SettingInfo{.low = 0, .high = 1e9, .help = "Seed of all random numbers."});
    field("map_latency",
          self.map_latency,
          SettingInfo{.low = 1,
                      .high = 100,
                      .unit = "frames",
                      .help = "From sending a keyframe to seeing the map with it, except in real "
                              "time. More gives the mapper more time beside the tracker."});
    field("features", self.features, SettingInfo{.help = "Corners and descriptors."});
    field("stereo", self.stereo, SettingInfo{.help = "Search in the second camera's image."});
    field("depth", self.depth, SettingInfo{.help = "Depth images."});
    field("view", self.view, SettingInfo{.help = "Which directions are used."});
    field("tracking", self.tracking, SettingInfo{.help = "Pose of each frame."});
    field("mapping", self.mapping, SettingInfo{.help = "Landmarks and keyframes."});
  }
};

}  // namespace waymark

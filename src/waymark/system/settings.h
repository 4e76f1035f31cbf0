// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// All settings, with their defaults; docs/settings.md lists them.
//
//   Settings changed;
//   changed.features.count = 1500;
//   read_settings(changed, parse_config(ConfigSource::from_file("settings.yaml")));
//   System other(rig, changed, Timing::kLockstep);

#include <cstdint>

#include "waymark/features/settings.h"
#include "waymark/loop/settings.h"
#include "waymark/mapping/settings.h"
#include "waymark/marker/settings.h"
#include "waymark/track/settings.h"

namespace waymark {

/// The constants of all stages as settings, for experiments; they change from version to version.
template <class Self>
struct ExperimentFields {
  Self& settings;  ///< Settings, or const Settings.

  /// Lists the fields, see SettingInfo.
  template <class Field>
  static void describe(ExperimentFields& self, Field&& field) {
    field("tracking", self.settings.tracking.options, {});
    field("mapping", self.settings.mapping.options, {});
    field("loop", self.settings.loop.options, {});
  }
};

/// All settings of the engine, one section per module. Cameras are read separately (camchain).
struct Settings {
  int seed = 0;                     ///< Of all random numbers.
  int map_latency = 2;              ///< In frames.
  int global_latency = 60;          ///< In frames.
  FeatureSettings features;         ///< Corners and descriptors.
  StereoSettings stereo;            ///< Search in the second camera's image.
  DepthSettings depth;              ///< Depth images.
  ViewSettings view;                ///< Which directions are used.
  TrackingSettings tracking;        ///< Pose of each frame.
  MappingSettings mapping;          ///< Landmarks and keyframes.
  CalibrationSettings calibration;  ///< Of the cameras, estimated along.
  LoopSettings loop;                ///< Places seen before.
  MarkerSettings markers;           ///< Square markers, off at first.

  /// Lists the fields, see SettingInfo.
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
    field("global_latency",
          self.global_latency,
          SettingInfo{.low = 1,
                      .high = 10000,
                      .unit = "frames",
                      .help = "From closing a loop to taking in the adjustment of all that it "
                              "ties together, except in real time."});
    field("features", self.features, SettingInfo{.help = "Corners and descriptors."});
    field("stereo", self.stereo, SettingInfo{.help = "Search in the second camera's image."});
    field("depth", self.depth, SettingInfo{.help = "Depth images."});
    field("view", self.view, SettingInfo{.help = "Which directions are used."});
    field("tracking", self.tracking, SettingInfo{.help = "Pose of each frame."});
    field("mapping", self.mapping, SettingInfo{.help = "Landmarks and keyframes."});
    field("calibration", self.calibration, SettingInfo{.help = "Of the cameras, estimated along."});
    field("loop", self.loop, SettingInfo{.help = "Places seen before."});
    field("markers", self.markers, SettingInfo{.help = "Square markers of known size."});
    ExperimentFields<Self> experiment{self};
    field("experiment", experiment, {});
  }
};

}  // namespace waymark

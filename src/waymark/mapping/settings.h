// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "waymark/base/check.h"
#include "waymark/base/settings.h"
#include "waymark/mapping/options.h"

namespace waymark {

/// What is made of the calibration that was given.
struct CalibrationSettings {
  /// "auto": changed where the images contradict it; "on": always to what fits them best; "off".
  std::string refine = "auto";

  /// Whether it may change at all. InputError for another word.
  bool is_refined() const {
    if (refine != "auto" && refine != "on" && refine != "off") {
      throw InputError("calibration.refine", "is " + refine + ", expected auto, on or off");
    }
    return refine != "off";
  }

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("refine",
          self.refine,
          SettingInfo{.help = "Estimate the calibration along with the map: auto changes it only "
                              "where the images contradict it, on always, off never."});
  }
};

/// Landmarks and keyframes.
struct MappingSettings {
  int window_keyframes = 12;    ///< That local bundle adjustment moves.
  MappingOptions options = {};  ///< Constants, for experiments.

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("window_keyframes",
          self.window_keyframes,
          SettingInfo{
              .low = 2, .high = 100, .help = "Keyframes that local bundle adjustment moves."});
  }
};

}  // namespace waymark

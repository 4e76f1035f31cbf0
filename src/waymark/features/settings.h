// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "waymark/base/check.h"
#include "waymark/base/settings.h"
#include "waymark/image/settings.h"

namespace waymark {

/// Corners and descriptors.
struct FeatureSettings {
  int count = 1000;      ///< Features per image.
  int min_contrast = 7;  ///< In grey values.
  bool edges = true;     ///< Points on edges join in where corners are few.

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("count",
          self.count,
          SettingInfo{
              .low = 80,  // So many landmarks begin a map.
              .high = 20000,
              .help = "Features per image; half as many again where it shows all directions."});
    field("min_contrast",
          self.min_contrast,
          SettingInfo{.low = 1,
                      .high = 100,
                      .unit = "grey values",
                      .help = "Corners with less contrast to their surroundings are ignored."});
    field("edges",
          self.edges,
          SettingInfo{.help = "Points on edges join in where an image has few corners, as of "
                              "blank walls."});
  }
};

/// Search in the second camera's image.
struct StereoSettings {
  double min_range_baselines = 4.0;  ///< Nearest range, in distances of the two cameras.

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("min_range_baselines",
          self.min_range_baselines,
          SettingInfo{.low = 0.1,
                      .high = 1000.0,
                      .help = "Nearest range that stereo search looks at, in baselines."});
  }
};

/// What is not used, since it moves along with the camera.
struct ViewSettings {
  double max_angle_deg = 180.0;  ///< Off the optical axis.
  double top_deg = 0.0;          ///< Around straight up, -y of the camera.
  double bottom_deg = 0.0;       ///< Around straight down, +y of the camera.
  std::string auto_mask = "on";  ///< "on": what moves along is looked for as well; "off".

  /// Whether what moves along is looked for. InputError for another word.
  bool is_auto_masked() const {
    if (auto_mask != "on" && auto_mask != "off") {
      throw InputError("view.auto_mask", "is " + auto_mask + ", expected on or off");
    }
    return auto_mask == "on";
  }

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("max_angle_deg",
          self.max_angle_deg,
          SettingInfo{.low = 1.0,
                      .high = 180.0,
                      .unit = "degrees",
                      .help = "No features farther than this off the optical axis."});
    field("top_deg",
          self.top_deg,
          SettingInfo{.low = 0.0,
                      .high = 90.0,
                      .unit = "degrees",
                      .help = "No features closer than this to straight up (-y of the camera)."});
    field("bottom_deg",
          self.bottom_deg,
          SettingInfo{.low = 0.0,
                      .high = 90.0,
                      .unit = "degrees",
                      .help = "No features closer than this to straight down (+y), where whoever "
                              "carries a 360 degree camera is."});
    field(
        "auto_mask",
        self.auto_mask,
        SettingInfo{.help = "Find what moves along with the camera, as a bonnet or burnt-in text, "
                            "and keep it free of features: on or off."});
  }
};

}  // namespace waymark

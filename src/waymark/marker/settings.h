// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "waymark/base/settings.h"

namespace waymark {

/// Square markers that are looked for.
struct MarkerSettings {
  std::string family = "off";  ///< "off", or one of marker_families().
  double size = 0.0;           ///< Side of the black square in metres; 0: in the file.
  std::string file;            ///< See read_known_markers(); empty: none.

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("family",
          self.family,
          SettingInfo{.help = "Markers to look for: tag36h11 and other families of AprilTag, "
                              "aruco_4x4_50 and others of ArUco, or off."});
    field("size",
          self.size,
          SettingInfo{.low = 0.0,
                      .high = 100.0,
                      .unit = "m",
                      .help = "Side of the black square of every marker that the file says nothing "
                              "else of."});
    field("file",
          self.file,
          SettingInfo{.help = "markers.yaml with sizes and known poses of single markers, and "
                              "family and size of all where the settings have none."});
  }
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/base/settings.h"

namespace waymark {

/// Landmarks and keyframes.
struct MappingSettings {
  int window_keyframes = 12;  ///< That local bundle adjustment moves.

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

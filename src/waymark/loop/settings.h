// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/base/settings.h"
#include "waymark/loop/options.h"

namespace waymark {

/// Places seen before.
struct LoopSettings {
  bool enabled = true;       ///< Off: loops stay open and sub-maps apart.
  LoopOptions options = {};  ///< Constants, for experiments.

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("enabled",
          self.enabled,
          SettingInfo{.help = "Recognise places seen before: close loops and join sub-maps."});
  }
};

}  // namespace waymark

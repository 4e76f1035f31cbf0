// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/base/settings.h"

namespace waymark {

/// Depth images.
struct DepthSettings {
  double factor = 1000.0;       ///< Units of the depth image per metre.
  double lag_ms = 0.0;          ///< How much later they are taken than their time stamps say.
  double inverse_offset = 0.0;  ///< Their inverse depths are too large by this, in 1/m.

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field(
        "factor",
        self.factor,
        SettingInfo{
            .low = 1.0, .high = 1e6, .unit = "1/m", .help = "Units of the depth image per metre."});
    field("lag_ms",
          self.lag_ms,
          SettingInfo{.low = -100.0,
                      .high = 100.0,
                      .unit = "ms",
                      .help = "Depth images are taken so much later than their time stamps say. "
                              "What the time stamps say is known."});
    field("inverse_offset",
          self.inverse_offset,
          SettingInfo{.low = -0.2,
                      .high = 0.2,
                      .unit = "1/m",
                      .help = "Inverse depths of depth images are too large by this."});
  }
};

}  // namespace waymark

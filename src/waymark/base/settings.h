// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

namespace waymark {

/// What describes one setting beside its name and default. A settings struct lists its fields once:
///
///   struct FeatureSettings {
///     int count = 1000;
///     template <class Self, class Field>
///     static void describe(Self& self, Field&& field) {
///       field("count", self.count, SettingInfo{.low = 100, .high = 20000,
///                                              .help = "Features per image."});
///     }
///   };
///
/// Reader, writer, help and documentation come from describe().
struct SettingInfo {
  double low = -std::numeric_limits<double>::infinity();   ///< Smallest allowed value.
  double high = std::numeric_limits<double>::infinity();   ///< Largest allowed value.
  const char* unit = "";
  const char* help = "";
};

}  // namespace waymark

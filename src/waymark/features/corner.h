// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace waymark {

/// A local maximum of the corner score at a pixel of one level.
struct Corner {
  std::uint16_t x_px = 0;
  std::uint16_t y_px = 0;
  std::uint8_t score = 0;

  friend bool operator==(const Corner&, const Corner&) = default;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "waymark/track/tracker.h"

namespace waymark {

/// What tracking a frame gave, all in one.
struct Tracked : TrackingResult {
  std::optional<MapperMessage> message;
};

}  // namespace waymark

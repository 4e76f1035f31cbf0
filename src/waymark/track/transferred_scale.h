// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/base/id.h"

namespace waymark {

/// A new part of a map that has the unit of length of the part before, as the speed of the camera
/// tells it: to about a quarter.
struct TransferredScale {
  SubmapId submap;  ///< The new part.
  SubmapId before;  ///< That in which the camera was lost.
};

}  // namespace waymark

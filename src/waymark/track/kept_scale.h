// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "waymark/base/id.h"

namespace waymark {

/// How long the unit of a new part of a map is in units of the part before.
struct KeptScale {
  SubmapId submap;                ///< The new part.
  SubmapId before;                ///< That in which the camera was lost.
  double scale = 1.0;             ///< That length.
  double log_sigma = 0.0;         ///< Standard deviation of the logarithm of the scale.
  std::size_t num_landmarks = 0;  ///< Of both parts that it rests on; 0: it rests on the motion.
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "waymark/base/id.h"
#include "waymark/image/features.h"

namespace waymark::python {

/// Features of a frame beside the landmarks they show, and what keeps both in memory.
struct PythonFeatures {
  std::shared_ptr<const Features> features;
  std::shared_ptr<const void> owner;  ///< Of the landmarks.
  const std::vector<LandmarkId>* landmarks = nullptr;
};

}  // namespace waymark::python

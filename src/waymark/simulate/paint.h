// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "waymark/base/rng.h"
#include "waymark/simulate/canvas.h"

namespace waymark {

/// What a surface looks like. All styles have marks of all sizes; kBare has next to none.
enum class Style : std::uint8_t {
  kWall,
  kBare,
  kFloor,
  kTiles,
  kCeiling,
  kBooks,
  kCrate,
  kPicture,
  kFacade,
  kRoad,
  kPavement,
  kFoliage,
  kMetal,
};

/// A picture of the style for a surface of this size, v pointing down.
Image paint(Style style, const Eigen::Vector2d& size_m, double texel_m, Rng& rng);

}  // namespace waymark

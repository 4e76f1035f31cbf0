// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "waymark/image/features.h"

namespace waymark {

/// Each descriptor is filed in so many tables, each by other bits of it.
inline constexpr std::size_t kNumPlaceTables = 4;
inline constexpr int kPlaceKeyBits = 48;

/// A sample of the bits of a descriptor in a random order. Descriptors that differ little are
/// likely to agree in a long prefix of it (Indyk and Motwani 1998; Bawa, Condie and Ganesan 2005),
/// and the number of its bits that differ tells how near they are.
using PlaceKey = std::uint64_t;

/// One key per table; no two share a bit of the descriptor. The choice of bits is fixed.
std::array<PlaceKey, kNumPlaceTables> place_keys(const Descriptor& descriptor);

}  // namespace waymark

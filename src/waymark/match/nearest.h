// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "waymark/features/features.h"

namespace waymark {

/// When a descriptor counts as recognised.
struct AppearanceOptions {
  int max_distance = 64;   ///< Largest Hamming distance, of 256 bits.
  double max_ratio = 0.8;  ///< Best to second-best distance (Lowe 2004, 7.1).
};

struct Nearest {
  std::uint32_t feature = kNoFeature;
  std::uint16_t distance = 0;
};

/// The candidate nearest to a descriptor, unless it is too far or a second one is nearly as near.
/// distances is a buffer.
std::optional<Nearest> find_nearest(const Descriptor& descriptor,
                                    std::span<const Descriptor> descriptors,
                                    std::span<const std::uint32_t> candidates,
                                    const AppearanceOptions& options,
                                    std::vector<std::uint16_t>& distances);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/features/features.h"

namespace waymark {

/// A place that looks like no other: random descriptors.
inline std::vector<Descriptor> random_place(std::size_t count, Rng& rng) {
  std::vector<Descriptor> descriptors(count);
  for (Descriptor& descriptor : descriptors) {
    for (std::uint64_t& word : descriptor) word = rng.next();
  }
  return descriptors;
}

/// The place seen again: each bit flips with a probability.
inline std::vector<Descriptor> seen_again(std::vector<Descriptor> descriptors,
                                          double flip_probability,
                                          Rng& rng) {
  for (Descriptor& descriptor : descriptors) {
    for (std::size_t bit = 0; bit < 256; ++bit) {
      if (rng.uniform() < flip_probability) descriptor[bit / 64] ^= std::uint64_t{1} << (bit % 64);
    }
  }
  return descriptors;
}

}  // namespace waymark

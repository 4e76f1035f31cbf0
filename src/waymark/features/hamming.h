// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "waymark/features/features.h"

namespace waymark {

inline constexpr int kDescriptorBits = 256;

/// Number of bits in which two descriptors differ, 0..256. Needs no population count instruction:
/// bits are summed within words, in nibbles and bytes (Warren, Hacker's Delight, section 5-1).
/// For more than a few pairs at a time, distances() is faster.
inline int hamming_distance(const Descriptor& a, const Descriptor& b) {
  std::uint64_t bytes = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::uint64_t word = a[i] ^ b[i];
    word -= (word >> 1) & 0x5555555555555555u;
    word = (word & 0x3333333333333333u) + ((word >> 2) & 0x3333333333333333u);
    bytes += (word + (word >> 4)) & 0x0f0f0f0f0f0f0f0fu;
  }
  const std::uint64_t pairs = (bytes & 0x00ff00ff00ff00ffu) + ((bytes >> 8) & 0x00ff00ff00ff00ffu);
  return static_cast<int>((pairs * 0x0001000100010001u) >> 48);
}

/// out[i] = hamming_distance(query, all[candidates[i]]). out has the size of candidates.
void distances(const Descriptor& query,
               std::span<const Descriptor> all,
               std::span<const std::uint32_t> candidates,
               std::span<std::uint16_t> out);

/// out[i] = hamming_distance(query, all[i]). out has the size of all.
void distances(const Descriptor& query,
               std::span<const Descriptor> all,
               std::span<std::uint16_t> out);

}  // namespace waymark

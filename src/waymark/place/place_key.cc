// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/place/place_key.h"

#include <utility>

#include "waymark/base/rng.h"
#include "waymark/image/hamming.h"

namespace waymark {
namespace {

static_assert(kNumPlaceTables * kPlaceKeyBits <= kDescriptorBits);

using BitOrder = std::array<std::uint8_t, kDescriptorBits>;

/// A shuffle of the bits of a descriptor (Fisher and Yates); consecutive runs of it make the keys.
BitOrder shuffled_bits() {
  BitOrder order;
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint8_t>(i);
  Rng rng(1, 0);
  for (std::uint32_t i = kDescriptorBits - 1; i > 0; --i) {
    std::swap(order[i], order[rng.below(i + 1)]);
  }
  return order;
}

}  // namespace

std::array<PlaceKey, kNumPlaceTables> place_keys(const Descriptor& descriptor) {
  static const BitOrder order = shuffled_bits();
  std::array<PlaceKey, kNumPlaceTables> keys = {};
  const std::uint8_t* bit = order.data();
  for (PlaceKey& key : keys) {
    for (int i = 0; i < kPlaceKeyBits; ++i, ++bit) {
      key = key << 1 | (descriptor[*bit / 64u] >> (*bit % 64u) & 1u);
    }
  }
  return keys;
}

}  // namespace waymark

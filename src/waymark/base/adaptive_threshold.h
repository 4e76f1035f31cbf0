// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>

namespace waymark {

/// How many landmarks something must rest on, given how many features the images offer: `full`,
/// or a fifth of what they offer where that is less, as of dark, blurred and blank images; but
/// never fewer than half of `full`, below which chance finds as much.
constexpr int adaptive_threshold(int full, std::size_t num_features) {
  constexpr std::size_t kOfFeatures = 5;
  return std::clamp(static_cast<int>(std::min<std::size_t>(num_features / kOfFeatures, 100'000)),
                    (full + 1) / 2,
                    full);
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/match/nearest.h"

#include <algorithm>

#include "waymark/features/hamming.h"

namespace waymark {

std::optional<Nearest> find_nearest(const Descriptor& descriptor,
                                    std::span<const Descriptor> descriptors,
                                    std::span<const std::uint32_t> candidates,
                                    const AppearanceOptions& options,
                                    std::vector<std::uint16_t>& distances) {
  if (candidates.empty()) return std::nullopt;
  distances.resize(candidates.size());
  waymark::distances(descriptor, descriptors, candidates, distances);
  std::size_t best = 0;
  int second = INT32_MAX;
  for (std::size_t k = 1; k < candidates.size(); ++k) {
    if (distances[k] < distances[best]) {
      second = distances[best];
      best = k;
    } else {
      second = std::min<int>(second, distances[k]);
    }
  }
  const int distance = distances[best];
  if (distance > options.max_distance || distance > options.max_ratio * second) return std::nullopt;
  return Nearest{candidates[best], distances[best]};
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/solver/bundle_kernel.h"

namespace waymark {

BundleArrays gather_bundle_observations(const BundleProblem& problem,
                                        std::span<const std::uint32_t> observations,
                                        std::span<const std::size_t> first_camera) {
  BundleArrays arrays;
  arrays.count = observations.size();
  const std::size_t padded = (arrays.count + kBundleLanes - 1) / kBundleLanes * kBundleLanes;
  for (auto& field : arrays.fields) field.assign(padded, 0.0);
  for (auto& places : arrays.places) places.assign(padded, 0);
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const BundleObservation& seen = problem.observations[observations[k]];
    for (int i = 0; i < 3; ++i) {
      const auto at = static_cast<std::size_t>(i);
      arrays.fields[kSeenBearingX + at][k] = seen.bearing[i];
      arrays.fields[kSeenW00 + at][k] = seen.level_pixel_from_bearing(0, i);
      arrays.fields[kSeenW10 + at][k] = seen.level_pixel_from_bearing(1, i);
    }
    if (seen.inverse_range_sigma > 0.0f) {
      arrays.has_ranges = true;
      arrays.fields[kSeenInverseRange][k] = seen.inverse_range;
      arrays.fields[kSeenInverseSigma][k] = 1.0 / double{seen.inverse_range_sigma};
    }
    arrays.places[0][k] = 12 * std::int64_t{seen.pose};
    arrays.places[1][k] = 12 * static_cast<std::int64_t>(first_camera[seen.pose] + seen.camera);
    arrays.places[2][k] = 3 * std::int64_t{seen.point};
  }
  return arrays;
}

}  // namespace waymark

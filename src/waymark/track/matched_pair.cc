// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/matched_pair.h"

#include "waymark/optimize/bundle.h"

namespace waymark {

RefinedPair refine_pair(const Features& a,
                        const Features& b,
                        std::span<const FeatureMatch> matches,
                        const TwoViewGeometry& geometry) {
  BundleProblem problem;
  problem.rig_from_world = {Rigid3{}, geometry.b_from_a};
  problem.rigs = {b.rig.get(), b.rig.get()};
  problem.is_pose_fixed = {1, 0};
  std::vector<FeatureMatch> kept;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!geometry.has_point[i]) continue;
    const auto point = static_cast<std::uint32_t>(problem.points.size());
    problem.points.push_back(geometry.points_in_a[i]);
    problem.observations.push_back({a.measurement(matches[i].a), 0, point});
    problem.observations.push_back({b.measurement(matches[i].b), 1, point});
    kept.push_back(matches[i]);
  }
  const BundleResult result = adjust_bundle(problem, BundleOptions{});
  RefinedPair refined;
  refined.b_from_a = problem.rig_from_world[1];
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (result.is_outlier[2 * i] || result.is_outlier[2 * i + 1]) continue;
    refined.points.push_back(problem.points[i]);
    refined.matches.push_back(kept[i]);
  }
  return refined;
}

}  // namespace waymark

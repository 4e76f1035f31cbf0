// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "waymark/features/features.h"
#include "waymark/geometry/two_view.h"
#include "waymark/match/appearance.h"

namespace waymark {

/// Bearings of matched features and their noise, as arrays of their own.
struct MatchedBearings {
  std::vector<Eigen::Vector3d> a, b;
  std::vector<double> sigmas_rad_a, sigmas_rad_b;

  MatchedBearings(const Features& features_a,
                  const Features& features_b,
                  std::span<const FeatureMatch> matches) {
    for (const FeatureMatch& match : matches) {
      a.push_back(features_a.bearings[match.a].cast<double>());
      b.push_back(features_b.bearings[match.b].cast<double>());
      sigmas_rad_a.push_back(features_a.size_rad[match.a]);
      sigmas_rad_b.push_back(features_b.size_rad[match.b]);
    }
  }

  BearingMatches view() const { return {a, b, sigmas_rad_a, sigmas_rad_b}; }
};

/// The points of a pair and its motion after adjustment, in units of the first translation.
struct RefinedPair {
  Rigid3 b_from_a;
  std::vector<Eigen::Vector3d> points;
  std::vector<FeatureMatch> matches;
};

/// Adjusts motion and points of two views by the same cameras.
RefinedPair refine_pair(const Features& a,
                        const Features& b,
                        std::span<const FeatureMatch> matches,
                        const TwoViewGeometry& geometry);

}  // namespace waymark

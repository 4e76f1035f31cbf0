// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "waymark/base/id.h"
#include "waymark/geometry/sim3.h"

namespace waymark {

/// Two keyframes that show the same place, of one sub-map (a loop) or of two (a join).
struct Revisit {
  /// Landmarks that are one and the same thing.
  struct Pair {
    LandmarkId of_query;
    LandmarkId of_match;
  };

  KeyframeId query;
  KeyframeId match;
  /// Of the rigs as the images say, whatever the map says; lengths in the units of the query.
  Sim3 query_from_match;
  std::vector<Pair> pairs;
  std::size_t num_inliers = 0;  ///< Matches that agree with query_from_match.
};

}  // namespace waymark

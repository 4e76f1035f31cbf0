// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <compare>
#include <cstdint>
#include <vector>

#include "waymark/base/id.h"
#include "waymark/image/features.h"

namespace waymark {

/// A feature of a keyframe that sees a landmark.
struct Observation {
  KeyframeId keyframe;                 ///< That sees the landmark.
  std::uint32_t feature = kNoFeature;  ///< Index in its Features.
  /// By keyframe, then by feature.
  friend constexpr auto operator<=>(const Observation&, const Observation&) = default;
};

/// What a landmark looks like and from where; a pure function of its observations.
struct Appearance {
  Descriptor descriptor{};  ///< The medoid of those of its newest observers.
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< Mean unit vector towards its observers.
  /// Extent in metres of one pixel of the level it was seen at: distance times size_rad.
  double size_m = 0.0;
};

/// A point of the map.
struct Landmark {
  SubmapId submap;  ///< Whose frame the position is in.
  /// In metres (map units where the scale is free).
  Eigen::Vector3d position_in_world = Eigen::Vector3d::Zero();
  KeyframeId reference;                   ///< The keyframe it was made from; moves with it.
  std::vector<Observation> observations;  ///< Ascending.
  Appearance appearance;                  ///< Brought up to date by the mapper.
  std::uint32_t num_visible = 0;          ///< Frames in which it should have been seen.
  std::uint32_t num_found = 0;            ///< Frames in which it was.
};

/// Number of distinct keyframes among observations in ascending order.
inline std::size_t num_observers(const Landmark& landmark) {
  std::size_t count = 0;
  KeyframeId last;
  for (const Observation& observation : landmark.observations) {
    count += observation.keyframe != last;
    last = observation.keyframe;
  }
  return count;
}

/// Whether a keyframe is among the observers.
inline bool is_observed_by(const Landmark& landmark, KeyframeId keyframe) {
  const auto first = std::lower_bound(
      landmark.observations.begin(), landmark.observations.end(), Observation{keyframe, 0});
  return first != landmark.observations.end() && first->keyframe == keyframe;
}

}  // namespace waymark

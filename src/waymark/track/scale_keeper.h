// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/match/appearance.h"
#include "waymark/optimize/similarity.h"
#include "waymark/track/initializer.h"
#include "waymark/track/kept_scale.h"

namespace waymark {

/// Where a camera without scale was lost in a map, a new part begins in units of its own. Finds
/// what they are in those of the part before, so that lengths of both can be compared.
class ScaleKeeper {
 public:
  explicit ScaleKeeper(std::uint64_t seed) : seed_(seed) {}

  /// Gives a new part the scale of that in which the camera was lost: by landmarks, else by its
  /// speed. What neither tells begins with a unit of its own. keyframes: where the camera was last,
  /// the speed being that of the newest of them. The new part is the next of the map.
  void keep(const Map& map, std::span<const KeyframeId> keyframes, Initialization& start);

  /// The parts of a map whose units are told by those of another part, in the order of time. Those
  /// that were joined to it meanwhile or know what a metre is are not among them.
  std::vector<KeptScale> kept_in(const Map& map) const;

  /// By what the new part and keyframes of the old one show alike: fewer landmarks than a pose
  /// rests on tell the scale between the two, as they have to agree in both (find_similarity()).
  /// Of several keyframes the one with which most agree counts.
  std::optional<KeptScale> by_landmarks(const Map& map,
                                        std::span<const KeyframeId> keyframes,
                                        const NewSubmap& start);

 private:
  LandmarkMatches match(const Map& map,
                        const Keyframe& before,
                        const NewSubmap& start,
                        std::size_t index);

  std::uint64_t seed_;
  AppearanceMatcher appearance_;
  std::vector<KeptScale> kept_;
};

/// By the speed of the newest keyframes up to `last`, which the camera should have kept up. Nothing
/// where it hardly moved.
std::optional<KeptScale> scale_by_speed(const Map& map, KeyframeId last, const NewSubmap& start);

/// Makes the lengths of a new part this many times as long.
void scale_by(double factor, Initialization& start);

}  // namespace waymark

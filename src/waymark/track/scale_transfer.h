// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/track/initializer.h"
#include "waymark/track/transferred_scale.h"

namespace waymark {

/// Where a camera without scale was lost in a map, a new part begins in units of its own. Gives it
/// those of the part before, so that lengths of both can be compared.
class ScaleTransfer {
 public:
  /// Gives a new part the scale of that in which the camera was lost, by its speed up to the
  /// keyframe `last`. What that does not tell begins with a unit of its own. The new part is the
  /// next of the map.
  void keep(const Map& map, KeyframeId last, Initialization& start);

  /// The parts of a map whose units are told by those of another part, in the order of time. Those
  /// that were joined to it meanwhile or know what a metre is are not among them.
  std::vector<TransferredScale> kept_in(const Map& map) const;

 private:
  std::vector<TransferredScale> kept_;
};

/// How long the unit of a new part is in those of the map, by the speed of the newest keyframes up
/// to `last`, which the camera should have kept up. Nothing where it hardly moved.
std::optional<double> scale_by_speed(const Map& map, KeyframeId last, const NewSubmap& start);

/// Makes the lengths of a new part this many times as long.
void scale_by(double factor, Initialization& start);

}  // namespace waymark

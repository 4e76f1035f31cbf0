// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/system/system.h"

namespace waymark {

/// Compares depth images of frames that are found in a map with that map: motion alone tells
/// nothing of a wrong scale of depth, a map in metres does.
class MapDepthCheck {
 public:
  /// map: as it was before the session. Without one in metres nothing is said.
  MapDepthCheck(std::shared_ptr<const Map> map, Rig rig);

  /// Of each frame with its pose, if it has one. Uses some of them.
  void add(const FrameImages& images, const TrackingResult& found);

  /// In words, after enough frames: the map says that a metre has a fifth more or less units.
  std::optional<std::string> advise(double units_per_metre) const;

 private:
  std::shared_ptr<const Map> map_;  ///< Null: nothing to compare with.
  Rig rig_;
  int num_found_ = 0;
  std::vector<double> units_per_metre_;  ///< By the map, the median of a frame each.
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "waymark/map/messages.h"
#include "waymark/mapping/associate.h"
#include "waymark/match/epipolar.h"
#include "waymark/place/map_snapshot.h"

namespace waymark {

/// A map that stays as it is, and on top of it what a stream has seen lately: keyframes and
/// landmarks to get along with where the map shows too little, to be thrown away afterwards. They
/// are put where tracking and triangulation say; nothing is adjusted, so that the map's own part
/// does not move.
class TemporaryMap {
 public:
  explicit TemporaryMap(const MapSnapshot& lasting);

  /// The map that stays and what was added to it, together.
  const MapSnapshot& visible() const { return visible_; }

  /// Adds a keyframe and makes landmarks of what it shows that no landmark explains yet.
  void add(const NewKeyframe& message);

  /// Only the map that stays remains.
  void clear();

 private:
  KeyframeId insert(const NewKeyframe& message);

  const MapSnapshot lasting_;
  MapSnapshot visible_;
  Map map_;
  DirtyLandmarks dirty_;
  EpipolarMatcher epipolar_;
};

}  // namespace waymark

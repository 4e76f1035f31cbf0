// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/match/landmark_set.h"

namespace waymark {

/// The part of the map around the camera.
struct LocalMap {
  KeyframeId reference;               ///< Shares most landmarks with the frame.
  std::vector<KeyframeId> keyframes;  ///< Most shared first.
  LandmarkSet landmarks;              ///< Seen by those keyframes, ascending by id.
};

/// The keyframe that sees most of the given landmarks, the youngest of several; invalid where none
/// does.
KeyframeId main_observer(const Map& map, std::span<const LandmarkId> seen);

/// Gathers the keyframes that see the given landmarks (ids of living landmarks; repeats allowed),
/// their strongest neighbours, and what all of these see. Bounded in size, whatever the size of
/// the map. If no keyframe sees any of them, the local map around fallback.
void gather_local_map(const Map& map,
                      std::span<const LandmarkId> seen,
                      KeyframeId fallback,
                      LocalMap& local);

/// The local map of a camera that moves: one serves some frames in the same map before it is
/// gathered anew. seen(): the landmarks around which it is gathered.
class RecentLocalMap {
 public:
  const LocalMap& around() const { return around_; }

  /// Of this map, however old.
  template <class Seen>
  void gather_once(const std::shared_ptr<const Map>& map, Seen&& seen, KeyframeId fallback) {
    if (source_ != map) gather(map, seen(), fallback);
  }
  /// Of this map and not too old.
  template <class Seen>
  void refresh(const std::shared_ptr<const Map>& map, Seen&& seen, KeyframeId fallback) {
    constexpr int kMaxAge = 5;
    if (source_ != map || ++age_ >= kMaxAge) gather(map, seen(), fallback);
  }
  /// The camera is elsewhere.
  void forget() { source_.reset(); }
  /// In a map that may lack what is newest.
  void continue_in(const Map& map) {
    forget();
    std::erase_if(around_.keyframes, [&](KeyframeId id) { return !map.keyframes().contains(id); });
  }

 private:
  void gather(const std::shared_ptr<const Map>& map,
              std::span<const LandmarkId> seen,
              KeyframeId fallback) {
    gather_local_map(*map, seen, fallback, around_);
    source_ = map;
    age_ = 0;
  }

  LocalMap around_;
  std::shared_ptr<const Map> source_;
  int age_ = 0;  ///< Frames.
};

}  // namespace waymark

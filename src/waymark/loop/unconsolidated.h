// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iterator>
#include <optional>
#include <set>
#include <span>

#include "waymark/map/map.h"

namespace waymark {

/// Keyframes that are to be compared with what lies beside them, the newest first: a closure brings
/// parts of the map together that may touch elsewhere, too.
class Unconsolidated {
 public:
  /// These, and what came to the map since the last time.
  void add(std::span<const KeyframeId> keyframes, const Map& map) {
    keyframes_.insert(keyframes.begin(), keyframes.end());
    for (; end_of_noted_ < map.keyframes().end_id(); ++end_of_noted_.value) {
      keyframes_.insert(keyframes_.end(), end_of_noted_);
    }
  }

  /// The next of those that still live.
  std::optional<KeyframeId> take(const Map& map) {
    while (!keyframes_.empty()) {
      const KeyframeId id = keyframes_.extract(std::prev(keyframes_.end())).value();
      if (map.keyframes().contains(id)) return id;
    }
    return std::nullopt;
  }

 private:
  std::set<KeyframeId> keyframes_;
  KeyframeId end_of_noted_{0};  ///< Keyframes below were among these at some time.
};

}  // namespace waymark

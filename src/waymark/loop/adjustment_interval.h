// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace waymark {

/// How often a map is adjusted as a whole for the loops that were closed in it: after each one
/// while it is small, else when it has grown by a part, until when the pose graph has to do. All
/// adjustments of a recording together thus take some seventeen times the last one, however many
/// loops there are.
class AdjustmentInterval {
 public:
  /// Whether a map of so many keyframes is to be adjusted, if there is a reason.
  bool is_due(std::size_t num_keyframes) const {
    return num_keyframes <= kSmall || num_keyframes >= next_;
  }
  /// It is being adjusted.
  void note(std::size_t num_keyframes) { next_ = num_keyframes + num_keyframes / kGrowthPart; }
  /// The next reason is enough.
  void hurry() { next_ = 0; }

 private:
  static constexpr std::size_t kSmall = 2000;
  static constexpr std::size_t kGrowthPart = 16;

  std::size_t next_ = 0;  ///< Keyframes of the map.
};

}  // namespace waymark

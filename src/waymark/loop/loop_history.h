// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/mapping/mapper.h"

namespace waymark {

/// What loops have to agree with: odometry, and the loops before, also those that were rejected.
class LoopHistory {
 public:
  /// What a new loop leads to.
  struct Verdict {
    bool is_accepted = true;
    bool has_undone = false;  ///< Loops of the map before that turned out to be false.
  };

  /// Notes in the map where keyframes that came since lie by odometry; before anything moves them.
  void note_odometry(Mapper& mapper);

  /// Weighs a loop that contradicts the map against odometry and the loops so far
  /// (reject_outlier_edges()). If it is them that turn out to be false, they are undone, and others
  /// that agree now come back.
  Verdict weigh(const LoopEdge& loop, Mapper& mapper);

  /// A loop was closed.
  void note_closed() { ++num_loops_; }
  /// Closed and not undone since.
  int num_loops() const { return num_loops_; }

 private:
  void undo(SubmapId submap,
            std::span<const std::uint8_t> is_on,
            std::span<const LoopEdge> also,
            Mapper& mapper);
  void reject(const LoopEdge& loop);

  KeyframeId end_of_odometry_{0};  ///< Keyframes below are noted in the map's.
  /// In units before any correction: further ones may agree with them.
  std::vector<LoopEdge> rejected_;
  int num_loops_ = 0;
};

}  // namespace waymark

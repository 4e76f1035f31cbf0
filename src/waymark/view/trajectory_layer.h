// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/view/message.h"
#include "waymark/view/update.h"

namespace waymark {

/// Tells of the frames of a session: their poses, which move with the map, and what became of them.
class TrajectoryLayer {
 public:
  void reset();
  std::size_t size() const { return notes_.size(); }
  /// When the first frame came, 0 before.
  std::int64_t start_ns() const { return start_ns_; }

  /// Takes in new notes and the next state of the map; tells what became new by that.
  void advance(std::span<const FrameNote> notes,
               const Map& before,
               const Map& after,
               std::vector<Message>& messages);
  void snapshot(const Map& map, std::vector<Message>& messages) const;

 private:
  void take(const FrameNote& note);
  /// Files a frame under the living keyframe that it moves with, or under pending_.
  void file(std::uint32_t index, const Map& map);
  void follow_keyframes(const Map& before, const Map& after);
  Message encode(std::span<const std::uint32_t> indices, const Map& map) const;

  std::int64_t start_ns_ = 0;
  std::vector<FrameNote> notes_;                       ///< Ascending by frame.
  std::vector<std::vector<std::uint32_t>> followers_;  ///< By keyframe: indices of notes.
  std::vector<std::uint32_t> pending_;                 ///< Whose keyframe is not in the map yet.
  std::vector<std::uint32_t> changed_;                 ///< Since the last message.
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/view/message.h"
#include "waymark/view/update.h"

namespace waymark {

/// Tells of the landmarks of a map: all of them, or the differences between two states of it.
class LandmarkLayer {
 public:
  /// Colours at the features of a frame, which may become a keyframe. Remembers those of the newest
  /// 1000 frames.
  void add_colors(FeatureColors colors);
  /// Gives new landmarks their colours. Before differences() and snapshot() of `after`.
  void color_landmarks(const Map& before, const Map& after);
  void reset();

  /// What turns one state of a map into a later one.
  void differences(const Map& before, const Map& after, std::vector<Message>& messages) const;
  void snapshot(const Map& map, std::vector<Message>& messages) const;

 private:
  struct Color {
    std::array<std::uint8_t, 3> rgb{};
    std::uint8_t is_known = 0;
  };

  Message encode(const Map& map, std::span<const LandmarkId> ids) const;

  std::unordered_map<std::uint32_t, FeatureColors>
      colors_of_frames_;       ///< By frame; only looked up.
  std::vector<Color> colors_;  ///< By landmark.
};

}  // namespace waymark

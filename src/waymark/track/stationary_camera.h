// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bitset>
#include <span>

#include "waymark/camera/camera.h"
#include "waymark/features/features.h"
#include "waymark/match/appearance.h"
#include "waymark/track/options.h"

namespace waymark {

/// Whether a camera has stood still since a frame, whatever moves before it: in some cells of the
/// image, in most of its rows and half of its columns, features stay where they were to half
/// a pixel in the median. Where a camera moves, what is far away moves with its turns; burnt-in
/// text and what moves along stay, but not all over. A camera that shows all directions may show
/// what carries it in half of its image or more; there three quarters have to stay.
/// Once at rest, it is for as long as most of the cells that stayed in one frame stay in the next:
/// things may come to hide nearly all of the view, a camera that moves leaves few cells at once.
class StationaryCamera {
 public:
  /// With the matches between the frame and a later one; for each in turn.
  void update(const Camera& camera,
              const Features& before,
              const Features& now,
              std::span<const FeatureMatch> matches,
              const StationaryOptions& options = {});
  bool is_at_rest() const { return staying_.any(); }

 private:
  static constexpr int kColumns = 6, kRows = 4;
  using Cells = std::bitset<kColumns * kRows>;

  static bool are_all_over(const Cells& staying,
                           const Cells& telling,
                           bool wraps,
                           const StationaryOptions& options);

  Cells staying_;  ///< In the last frame at rest; none where the camera is not.
};

}  // namespace waymark

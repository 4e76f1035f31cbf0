// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "waymark/features/corner.h"
#include "waymark/features/pyramid.h"

namespace waymark {

using LevelCounts = std::array<int, Pyramid::kNumLevels>;

/// How many of count features to take from each level, given how many corners each has. Shares are
/// proportional to 1 / scale; what a level cannot give is asked of the others, so that the sum is
/// count whenever there are as many corners.
LevelCounts share_among_levels(int count, const LevelCounts& available);

/// Chooses strong corners that are spread evenly over an image: suppression via square covering
/// (Bailo et al. 2018, section 3.3). Going from strong to weak, a corner is taken unless it lies
/// in the square around one that was; the size of the squares is searched such that half of the
/// count remains. The other half are the strongest corners left: which of two neighbours of like
/// strength wins changes from image to image, so spacing alone chooses corners that are not found
/// again (docs/decisions/image.md). Keeps its buffers.
class NonMaximalSuppression {
 public:
  /// Makes room for any corners of images up to this size, so that select() allocates nothing.
  void reserve(int width_px, int height_px, int max_count);

  /// Replaces the contents of selected by count of the corners, or all if there are fewer, in
  /// raster order. Corners must be in raster order and within the image, which must not be larger
  /// than what was reserved.
  void select(std::span<const Corner> corners,
              int width_px,
              int height_px,
              int count,
              std::vector<Corner>& selected);

 private:
  void sort_by_score(std::span<const Corner> corners);
  std::size_t suppress(double cell_px, int width_px, int height_px, std::size_t limit);
  void search(int width_px, int height_px, std::size_t count);
  void adjust(std::size_t count);

  std::size_t num_sorted_ = 0;
  std::vector<Corner> sorted_;         ///< Descending score, then in the order given.
  std::vector<std::uint32_t> taken_;   ///< Indices in sorted_, ascending, by the last suppress().
  std::vector<std::uint32_t> best_;    ///< By the widest suppress() that left enough.
  std::vector<std::uint8_t> covered_;  ///< Cells of half the size of a square.
};

}  // namespace waymark

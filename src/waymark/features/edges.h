// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "waymark/image/padded_image.h"

namespace waymark {

/// A point on an edge, in pixels of its level. Only its place across the edge is measured.
struct EdgePoint {
  float x_px = 0.0f;       ///< To the right, sub-pixel.
  float y_px = 0.0f;       ///< Down, sub-pixel.
  float angle_rad = 0.0f;  ///< Across the edge, to the lighter side; clockwise as y points down.
  float slope = 0.0f;      ///< Grey values per pixel, across.
};

/// Which edges to find.
struct EdgeRequest {
  int border_px = 7;         ///< Nearest to the border of the image, at least 7.
  double min_slope = 0.7;    ///< Grey values per pixel; no edge is less steep, ...
  double clear_slope = 2.5;  ///< ... and one as steep as that is one, however noisy the image.
  std::size_t count = 500;   ///< At most; the steepest.
};

/// Finds points on edges: where the slope of the grey values, of an image smoothed by a small
/// binomial, has its maximum along its own direction (Canny 1986), to sub-pixel accuracy by a
/// parabola (Devernay 1995). Edges are straight there for 4 px to both sides, so that a neighbour
/// of a point tells the same; place and direction are those of the line through all of that, so
/// that noise averages out. How much steeper than its surroundings an edge must be follows the
/// noise of the image. One point per cell of the image at most, which spreads them. Same image,
/// same bits. Keeps its buffers.
class EdgeFinder {
 public:
  static constexpr int kCellPx = 8;

  /// A pixel where is_free, which may be empty, is 0 belongs to a cell without edges: one entry for
  /// each cell in rows of ceil(width / kCellPx). The result is in the order of the cells and stays
  /// valid until the next call.
  std::span<const EdgePoint> find(const PaddedImage& image,
                                  std::span<const std::uint8_t> is_free,
                                  const EdgeRequest& request);

 private:
  struct Gradient {
    std::int16_t x;
    std::int16_t y;
  };

  void differentiate(const PaddedImage& image);
  const Gradient& at(int x, int y) const {
    return gradients_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px_) +
                      static_cast<std::size_t>(x)];
  }
  float slope_at(int x, int y) const;
  /// Standard deviation of a derivative where the image shows nothing.
  float measure_noise();
  bool is_straight(int x, int y, const EdgePoint& point) const;
  /// Slope in a direction between pixels.
  float slope_along(float x, float y, float nx, float ny) const;
  /// By how much the ridge through a point is steeper than what is beside it.
  float rise_above_sides(const EdgePoint& point) const;
  /// Moves a point to the line through its edge nearby; false where there is none.
  bool fit_line(EdgePoint& point) const;
  /// The point of the edge through a pixel, if that is its ridge.
  bool locate(int x, int y, EdgePoint& point) const;
  void limit(std::size_t count);

  int width_px_ = 0;
  int height_px_ = 0;
  std::vector<std::int16_t> smooth_;  ///< Along rows; 16 times the grey values.
  std::vector<std::int16_t> change_;  ///< Along rows; 8 times the slope.
  std::vector<Gradient> gradients_;   ///< 128 times the slope.
  std::vector<EdgePoint> best_;       ///< Per cell; slope 0 where there is none.
  std::vector<float> slopes_;
  std::vector<EdgePoint> points_;
};

}  // namespace waymark

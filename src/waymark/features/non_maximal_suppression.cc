// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/non_maximal_suppression.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "waymark/features/corners.h"

namespace waymark {
namespace {

// A taken corner covers its own cell and this many cells to each side.
constexpr int kReach = 2;

// A frame of kReach cells makes room for squares that stick out; one more cell for what is left of
// the division of the image.
constexpr int kFrame = 2 * kReach + 1;

// Below this size of a cell, corners are so dense that spacing them is no use.
constexpr double kMinCellPx = 1.0;

// The search for the size of a cell ends when at most this many too many corners remain.
constexpr double kTolerance = 0.05;
constexpr int kMaxTrials = 8;

// Size of the first cell and its growth, relative to the side of the area per corner.
constexpr double kFirstGuess = 0.4;
constexpr double kGrowth = 1.25;

std::size_t tolerated(std::size_t count) {
  return static_cast<std::size_t>(static_cast<double>(count) * (1.0 + kTolerance)) + 2;
}

}  // namespace

LevelCounts share_among_levels(int count, const LevelCounts& available) {
  LevelCounts counts{};
  int missing = count;
  // Each round offers what is missing to the levels that have corners left.
  while (missing > 0) {
    double weight_left = 0.0;
    for (int level = 0; level < Pyramid::kNumLevels; ++level) {
      const auto i = static_cast<std::size_t>(level);
      if (counts[i] < available[i]) weight_left += 1.0 / Pyramid::scale(level);
    }
    if (weight_left == 0.0) break;
    int to_share = missing;
    for (int level = 0; level < Pyramid::kNumLevels; ++level) {
      const auto i = static_cast<std::size_t>(level);
      if (counts[i] >= available[i]) continue;
      const double weight = 1.0 / Pyramid::scale(level);
      const int share = static_cast<int>(std::lround(to_share * weight / weight_left));
      const int given = std::min(share, available[i] - counts[i]);
      counts[i] += given;
      missing -= given;
      to_share -= share;
      weight_left -= weight;
    }
  }
  return counts;
}

void NonMaximalSuppression::reserve(int width_px, int height_px, int max_count) {
  const auto num_cells = static_cast<std::size_t>((width_px / kMinCellPx + kFrame) *
                                                  (height_px / kMinCellPx + kFrame));
  if (covered_.size() < num_cells) covered_.resize(num_cells);
  const std::size_t num_corners = max_num_corners(width_px, height_px);
  if (sorted_.size() < num_corners) sorted_.resize(num_corners);
  const std::size_t limit = tolerated(static_cast<std::size_t>(max_count));
  taken_.reserve(limit);
  best_.reserve(limit);
}

void NonMaximalSuppression::sort_by_score(std::span<const Corner> corners) {
  std::array<std::uint32_t, 257> begin{};
  for (const Corner& corner : corners) ++begin[256u - corner.score];
  for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
  for (const Corner& corner : corners) sorted_[begin[255u - corner.score]++] = corner;
  num_sorted_ = corners.size();
}

// Takes corners until there are limit; returns how many there are.
std::size_t NonMaximalSuppression::suppress(double cell_px,
                                            int width_px,
                                            int height_px,
                                            std::size_t limit) {
  const float cells_per_px = static_cast<float>(1.0 / cell_px);
  const int columns = static_cast<int>(width_px * cells_per_px) + kFrame;
  const int rows = static_cast<int>(height_px * cells_per_px) + kFrame;
  std::fill_n(covered_.begin(), columns * rows, std::uint8_t{0});
  taken_.clear();
  for (std::size_t i = 0; i < num_sorted_ && taken_.size() < limit; ++i) {
    const int column = static_cast<int>(static_cast<float>(sorted_[i].x_px) * cells_per_px);
    const int row = static_cast<int>(static_cast<float>(sorted_[i].y_px) * cells_per_px);
    std::uint8_t* const square = covered_.data() + row * columns + column;
    if (square[kReach * columns + kReach] != 0) continue;
    taken_.push_back(static_cast<std::uint32_t>(i));
    for (int y = 0; y <= 2 * kReach; ++y) std::memset(square + y * columns, 1, 2 * kReach + 1);
  }
  return taken_.size();
}

// Leaves in best_ what the widest squares found leave, at least count corners if any squares do.
// Between two trials, the number of corners is taken to go with the inverse area of a square.
void NonMaximalSuppression::search(int width_px, int height_px, std::size_t count) {
  const double area = static_cast<double>(width_px) * height_px;
  const std::size_t limit = tolerated(count);
  double low = kMinCellPx;
  double high = std::max(low, std::sqrt(area / static_cast<double>(count)));
  double cell = std::max(low, kFirstGuess * high);
  best_.clear();
  for (int trial = 0; trial < kMaxTrials; ++trial) {
    const std::size_t remaining = suppress(cell, width_px, height_px, limit);
    if (remaining >= count) {
      std::swap(best_, taken_);
      if (remaining < limit) return;
      low = cell;
      cell = std::min(cell * kGrowth, std::sqrt(low * high));
    } else {
      high = cell;
      cell *= std::sqrt(static_cast<double>(remaining) / static_cast<double>(limit));
      if (cell <= low) cell = std::sqrt(low * high);
    }
  }
}

// Makes best_ count corners: drops its weakest, or adds the strongest that it lacks.
void NonMaximalSuppression::adjust(std::size_t count) {
  if (best_.empty()) std::swap(best_, taken_);
  if (best_.size() >= count) return best_.resize(count);
  taken_.clear();
  std::size_t num_missing = count - best_.size();
  auto next = best_.begin();
  for (std::uint32_t i = 0; taken_.size() < count; ++i) {
    const bool is_taken = next != best_.end() && *next == i;
    if (is_taken) ++next;
    if (!is_taken && num_missing > 0)
      --num_missing;
    else if (!is_taken)
      continue;
    taken_.push_back(i);
  }
  std::swap(best_, taken_);
}

void NonMaximalSuppression::select(std::span<const Corner> corners,
                                   int width_px,
                                   int height_px,
                                   int count,
                                   std::vector<Corner>& selected) {
  const auto wanted = static_cast<std::size_t>(std::max(count, 0));
  selected.clear();
  if (wanted == 0) return;
  if (corners.size() <= wanted) {
    selected.assign(corners.begin(), corners.end());
  } else {
    sort_by_score(corners);
    const std::size_t num_covering = (wanted + 1) / 2;
    search(width_px, height_px, num_covering);
    adjust(num_covering);
    adjust(wanted);
    for (std::uint32_t i : best_) selected.push_back(sorted_[i]);
  }
  std::sort(selected.begin(), selected.end(), [](const Corner& a, const Corner& b) {
    return a.y_px != b.y_px ? a.y_px < b.y_px : a.x_px < b.x_px;
  });
}

}  // namespace waymark

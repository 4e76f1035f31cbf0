// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory_resource>
#include <vector>

namespace waymark {

/// Buckets of points in an image, for search windows. Built once, then read-only.
/// Contents of a cell are contiguous and in ascending order of index.
class FeatureGrid {
 public:
  FeatureGrid() = default;

  /// pixel(i) gives the pixel of point i of count. wrap_width_px: see Camera.
  template <class PixelOf>
  FeatureGrid(int width_px, int height_px, double wrap_width_px, std::size_t count, PixelOf pixel);

  /// A copy in this memory, of num_bytes().
  FeatureGrid(const FeatureGrid& other, std::pmr::memory_resource* memory)
      : columns_(other.columns_),
        rows_(other.rows_),
        wrap_width_px_(other.wrap_width_px_),
        cell_begin_(other.cell_begin_, memory),
        indices_(other.indices_, memory) {}

  /// Of its arrays.
  std::size_t num_bytes() const {
    return (cell_begin_.size() + indices_.size()) * sizeof(std::uint32_t);
  }

  /// Calls visit(index) for each point in the cells that touch the square of half side radius_px
  /// around (x, y): a superset of the points within it.
  template <class Visit>
  void visit_near(double x_px, double y_px, double radius_px, Visit visit) const {
    visit_window(x_px, y_px, radius_px, radius_px, visit);
  }
  /// The same for a rectangle of these half sides.
  template <class Visit>
  void visit_window(
      double x_px, double y_px, double half_width_px, double half_height_px, Visit visit) const;

  /// Distance between two columns, the shorter way round where they repeat.
  double column_distance_px(double a_px, double b_px) const {
    const double distance = std::abs(a_px - b_px);
    return wrap_width_px_ > 0.0 ? std::min(distance, wrap_width_px_ - distance) : distance;
  }

 private:
  static constexpr int kCellPx = 16;

  int column_of(double x_px) const {
    return std::clamp(static_cast<int>((x_px + 0.5) / kCellPx), 0, columns_ - 1);
  }
  int row_of(double y_px) const {
    return std::clamp(static_cast<int>((y_px + 0.5) / kCellPx), 0, rows_ - 1);
  }
  template <class Visit>
  void visit_columns(double left, double right, int row0, int row1, Visit& visit) const;

  int columns_ = 0;
  int rows_ = 0;
  double wrap_width_px_ = 0.0;
  std::pmr::vector<std::uint32_t> cell_begin_;  ///< Row-major cells, one more for the end.
  std::pmr::vector<std::uint32_t> indices_;
};

template <class PixelOf>
FeatureGrid::FeatureGrid(
    int width_px, int height_px, double wrap_width_px, std::size_t count, PixelOf pixel)
    : columns_((width_px + kCellPx - 1) / kCellPx),
      rows_((height_px + kCellPx - 1) / kCellPx),
      wrap_width_px_(wrap_width_px),
      cell_begin_(static_cast<std::size_t>(columns_ * rows_) + 1, 0),
      indices_(count) {
  std::vector<std::uint32_t> cell_of(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto [x, y] = pixel(i);
    cell_of[i] = static_cast<std::uint32_t>(row_of(y) * columns_ + column_of(x));
    ++cell_begin_[cell_of[i] + 1];
  }
  for (std::size_t c = 1; c < cell_begin_.size(); ++c) cell_begin_[c] += cell_begin_[c - 1];
  std::vector<std::uint32_t> next(cell_begin_.begin(), cell_begin_.end() - 1);
  for (std::size_t i = 0; i < count; ++i) {
    indices_[next[cell_of[i]]++] = static_cast<std::uint32_t>(i);
  }
}

template <class Visit>
void FeatureGrid::visit_columns(double left, double right, int row0, int row1, Visit& visit) const {
  const int column0 = column_of(left);
  const int column1 = column_of(right);
  for (int row = row0; row <= row1; ++row) {
    const std::size_t cells = static_cast<std::size_t>(row * columns_);
    const std::uint32_t begin = cell_begin_[cells + static_cast<std::size_t>(column0)];
    const std::uint32_t end = cell_begin_[cells + static_cast<std::size_t>(column1) + 1];
    for (std::uint32_t k = begin; k < end; ++k) visit(indices_[k]);
  }
}

template <class Visit>
void FeatureGrid::visit_window(
    double x_px, double y_px, double half_width_px, double half_height_px, Visit visit) const {
  if (indices_.empty()) return;
  const int row0 = row_of(y_px - half_height_px);
  const int row1 = row_of(y_px + half_height_px);
  const double left = x_px - half_width_px;
  const double right = x_px + half_width_px;
  if (wrap_width_px_ <= 0.0) return visit_columns(left, right, row0, row1, visit);
  if (right - left >= wrap_width_px_ - kCellPx) {
    return visit_columns(0.0, wrap_width_px_, row0, row1, visit);
  }
  if (left < -0.5) {
    visit_columns(left + wrap_width_px_, wrap_width_px_, row0, row1, visit);
  }
  visit_columns(std::max(left, 0.0), std::min(right, wrap_width_px_), row0, row1, visit);
  if (right > wrap_width_px_ - 0.5) {
    visit_columns(0.0, right - wrap_width_px_, row0, row1, visit);
  }
}

}  // namespace waymark

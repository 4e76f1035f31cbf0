// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/edges.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "waymark/base/check.h"

namespace waymark {
namespace {

/// Of what differentiate() gives: 16 for the smoothing, 8 for the derivative.
constexpr float kGradientUnit = 1.0f / 128.0f;
/// An edge is straight if it still is there this far along it to both sides, ...
constexpr int kStraightPx = 4;
constexpr float kStraightCos = 0.95f;  ///< ... in the same direction ...
constexpr float kLeastSteady = 0.5f;   ///< ... and with at least this part of its slope.
/// An edge is as much steeper than what is this far beside it: the slope of a shaded surface has
/// ridges, too, wherever noise makes them.
constexpr float kBesidePx = 3.0f;
/// That much of the least slope, as the smoothing leaves some of an edge's beside it.
constexpr float kLeastRise = 0.6f;
/// So far from a point its edge is looked at, rounded up.
constexpr int kReachPx = kStraightPx + 3;
/// An edge is steeper than noise by this many of its standard deviations: of 100 000 pixels one is
/// by chance, and is not straight.
constexpr float kNoiseSigmas = 5.0f;
/// The quarter of the slopes of nothing but noise that are least are below this many of its
/// standard deviations (Rayleigh distribution). What an image shows is in the other three.
constexpr float kQuartile = 0.7585f;
/// Every so many rows and columns tell.
constexpr int kNoiseStepPx = 4;
/// On the line through an edge at least so many places of 2 kStraightPx + 1 show it.
constexpr int kMinOnLine = 7;

}  // namespace

std::span<const EdgePoint> EdgeFinder::find(const PaddedImage& image,
                                            std::span<const std::uint8_t> is_free,
                                            const EdgeRequest& request) {
  WAYMARK_CHECK(request.border_px >= kReachPx);
  width_px_ = image.width_px();
  height_px_ = image.height_px();
  points_.clear();
  const int border = request.border_px + 1;
  if (width_px_ <= 2 * border || height_px_ <= 2 * border) return points_;
  differentiate(image);
  const int columns = (width_px_ + kCellPx - 1) / kCellPx;
  const int rows = (height_px_ + kCellPx - 1) / kCellPx;
  best_.assign(static_cast<std::size_t>(columns * rows), EdgePoint());
  WAYMARK_CHECK(is_free.empty() || is_free.size() == best_.size());
  const float least = std::clamp(kNoiseSigmas * measure_noise(),
                                 static_cast<float>(request.min_slope) / kGradientUnit,
                                 static_cast<float>(request.clear_slope) / kGradientUnit);
  const float least_squared = least * least;
  for (int y = border; y < height_px_ - border; ++y) {
    for (int x = border; x < width_px_ - border; ++x) {
      const Gradient& gradient = at(x, y);
      const auto gx = static_cast<float>(gradient.x);
      const auto gy = static_cast<float>(gradient.y);
      if (gx * gx + gy * gy < least_squared) continue;
      const auto cell = static_cast<std::size_t>((y / kCellPx) * columns + x / kCellPx);
      if (!is_free.empty() && !is_free[cell]) continue;
      EdgePoint point;
      if (locate(x, y, point) && point.slope > best_[cell].slope) best_[cell] = point;
    }
  }
  std::ranges::copy_if(
      best_, std::back_inserter(points_), [](const EdgePoint& p) { return p.slope > 0.0f; });
  limit(request.count);
  std::erase_if(points_, [&](EdgePoint& point) {
    return rise_above_sides(point) < kLeastRise * least || !fit_line(point);
  });
  return points_;
}

/// Smoothed by (1 4 6 4 1) / 16 one way and its derivative (-1 -2 0 2 1) / 8 the other; rows and
/// columns at the border are left at 0.
void EdgeFinder::differentiate(const PaddedImage& image) {
  const auto width = static_cast<std::size_t>(width_px_);
  const std::size_t size = width * static_cast<std::size_t>(height_px_);
  smooth_.assign(size, 0);
  change_.assign(size, 0);
  gradients_.assign(size, Gradient{0, 0});
  for (int y = 0; y < height_px_; ++y) {
    const std::uint8_t* const row = image.row(y);
    std::int16_t* const smooth = smooth_.data() + static_cast<std::size_t>(y) * width;
    std::int16_t* const change = change_.data() + static_cast<std::size_t>(y) * width;
    for (int x = 2; x < width_px_ - 2; ++x) {
      const int sum = row[x - 2] + row[x + 2] + 4 * (row[x - 1] + row[x + 1]) + 6 * row[x];
      smooth[x] = static_cast<std::int16_t>(sum);
      change[x] =
          static_cast<std::int16_t>(row[x + 2] - row[x - 2] + 2 * (row[x + 1] - row[x - 1]));
    }
  }
  for (std::size_t i = 2 * width; i < size - 2 * width; ++i) {
    const int x = change_[i - 2 * width] + change_[i + 2 * width] +
                  4 * (change_[i - width] + change_[i + width]) + 6 * change_[i];
    const int y = smooth_[i + 2 * width] - smooth_[i - 2 * width] +
                  2 * (smooth_[i + width] - smooth_[i - width]);
    gradients_[i] = {static_cast<std::int16_t>(x), static_cast<std::int16_t>(y)};
  }
}

float EdgeFinder::slope_at(int x, int y) const {
  const Gradient& gradient = at(x, y);
  const auto gx = static_cast<float>(gradient.x);
  const auto gy = static_cast<float>(gradient.y);
  return std::sqrt(gx * gx + gy * gy);
}

bool EdgeFinder::locate(int x, int y, EdgePoint& point) const {
  const auto gx = static_cast<float>(at(x, y).x);
  const auto gy = static_cast<float>(at(x, y).y);
  const bool is_steep_in_x = std::abs(gx) >= std::abs(gy);
  const float ratio = is_steep_in_x ? gy / gx : gx / gy;
  const int aside = ratio < 0.0f ? -1 : 1;
  // One column (row) on, between the two rows (columns) that the direction passes.
  const auto beside = [&](int step) {
    const int across = step * aside;
    const float straight = is_steep_in_x ? slope_at(x + step, y) : slope_at(x, y + step);
    const float slanted =
        is_steep_in_x ? slope_at(x + step, y + across) : slope_at(x + across, y + step);
    return straight + std::abs(ratio) * (slanted - straight);
  };
  const float here = std::sqrt(gx * gx + gy * gy);
  const float before = beside(-1);
  const float after = beside(1);
  if (!(here > before && here >= after)) return false;
  const float offset = 0.5f * (before - after) / (before - 2.0f * here + after);
  point.x_px = static_cast<float>(x) + offset * (is_steep_in_x ? 1.0f : ratio);
  point.y_px = static_cast<float>(y) + offset * (is_steep_in_x ? ratio : 1.0f);
  point.angle_rad = std::atan2(gy, gx);
  point.slope = kGradientUnit * here;
  return is_straight(x, y, point);
}

float EdgeFinder::measure_noise() {
  slopes_.clear();
  for (int y = kNoiseStepPx; y < height_px_ - kNoiseStepPx; y += kNoiseStepPx) {
    for (int x = kNoiseStepPx; x < width_px_ - kNoiseStepPx; x += kNoiseStepPx) {
      // Black and white parts show no noise either.
      if (const float slope = slope_at(x, y); slope > 0.0f) slopes_.push_back(slope);
    }
  }
  if (slopes_.empty()) return 0.0f;
  const auto quarter = slopes_.begin() + static_cast<std::ptrdiff_t>(slopes_.size() / 4);
  std::nth_element(slopes_.begin(), quarter, slopes_.end());
  return *quarter / kQuartile;
}

float EdgeFinder::slope_along(float x, float y, float nx, float ny) const {
  const int left = static_cast<int>(x);
  const int top = static_cast<int>(y);
  const float right_share = x - static_cast<float>(left);
  const float bottom_share = y - static_cast<float>(top);
  const auto slope = [&](int column, int row) {
    const Gradient& gradient = at(column, row);
    return nx * static_cast<float>(gradient.x) + ny * static_cast<float>(gradient.y);
  };
  const float above = std::lerp(slope(left, top), slope(left + 1, top), right_share);
  const float below = std::lerp(slope(left, top + 1), slope(left + 1, top + 1), right_share);
  return std::lerp(above, below, bottom_share);
}

float EdgeFinder::rise_above_sides(const EdgePoint& point) const {
  const float nx = std::cos(point.angle_rad);
  const float ny = std::sin(point.angle_rad);
  float here = 0.0f, before = 0.0f, after = 0.0f;
  for (int step = -kStraightPx; step <= kStraightPx; ++step) {
    const float x = point.x_px - static_cast<float>(step) * ny;
    const float y = point.y_px + static_cast<float>(step) * nx;
    here += slope_along(x, y, nx, ny);
    before += slope_along(x - kBesidePx * nx, y - kBesidePx * ny, nx, ny);
    after += slope_along(x + kBesidePx * nx, y + kBesidePx * ny, nx, ny);
  }
  return (here - std::max(before, after)) / static_cast<float>(2 * kStraightPx + 1);
}

/// Least squares over the ridge at equal steps along the edge.
bool EdgeFinder::fit_line(EdgePoint& point) const {
  const float nx = std::cos(point.angle_rad);
  const float ny = std::sin(point.angle_rad);
  float count = 0.0f, sum = 0.0f, sum_along = 0.0f, sum_along_off = 0.0f, sum_along_along = 0.0f;
  for (int step = -kStraightPx; step <= kStraightPx; ++step) {
    const auto along = static_cast<float>(step);
    const float x = point.x_px - along * ny;
    const float y = point.y_px + along * nx;
    const float before = slope_along(x - nx, y - ny, nx, ny);
    const float here = slope_along(x, y, nx, ny);
    const float after = slope_along(x + nx, y + ny, nx, ny);
    if (!(here > before && here >= after)) continue;
    const float off = 0.5f * (before - after) / (before - 2.0f * here + after);
    count += 1.0f;
    sum += off;
    sum_along += along;
    sum_along_off += along * off;
    sum_along_along += along * along;
  }
  if (count < static_cast<float>(kMinOnLine)) return false;
  const float turn =
      (count * sum_along_off - sum_along * sum) / (count * sum_along_along - sum_along * sum_along);
  const float off = (sum - turn * sum_along) / count;
  point.x_px += off * nx;
  point.y_px += off * ny;
  // Along goes from (nx, ny) by a right angle clockwise, where off grows by turn.
  point.angle_rad = std::atan2(ny - turn * nx, nx + turn * ny);
  return true;
}

bool EdgeFinder::is_straight(int x, int y, const EdgePoint& point) const {
  const float nx = std::cos(point.angle_rad);
  const float ny = std::sin(point.angle_rad);
  for (const int step : {-kStraightPx, kStraightPx}) {
    const int x1 = x - static_cast<int>(std::lround(static_cast<float>(step) * ny));
    const int y1 = y + static_cast<int>(std::lround(static_cast<float>(step) * nx));
    const Gradient& gradient = at(x1, y1);
    const float slope = slope_at(x1, y1);
    const float along = nx * static_cast<float>(gradient.x) + ny * static_cast<float>(gradient.y);
    if (along < kStraightCos * slope) return false;
    if (kGradientUnit * slope < kLeastSteady * point.slope) return false;
  }
  return true;
}

void EdgeFinder::limit(std::size_t count) {
  if (points_.size() <= count) return;
  slopes_.clear();
  for (const EdgePoint& point : points_) slopes_.push_back(point.slope);
  const auto last = slopes_.begin() + static_cast<std::ptrdiff_t>(count);
  std::nth_element(slopes_.begin(), last, slopes_.end(), std::greater<>());
  const float least = *last;
  std::erase_if(points_, [&](const EdgePoint& point) { return point.slope <= least; });
}

}  // namespace waymark

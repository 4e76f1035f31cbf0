// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/image_statistics.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <vector>

namespace waymark {
namespace {

constexpr int kMinSidePx = 24;
constexpr int kNumLines = 48;  ///< Rows, and as many columns.
constexpr std::size_t kMeanOver = 9;

/// Sums over pixels of 2 x 2 along a line, in four times grey values.
struct LineSums {
  std::int64_t num = 0;
  std::int64_t sum = 0;
  std::int64_t squares = 0;
  std::int64_t steps = 0;    ///< Of neighbours, times kMeanOver.
  std::int64_t smeared = 0;  ///< What a mean along the line takes of these.

  void add(const std::vector<int>& line);
  double blur() const {
    if (steps == 0) return 1.0;
    const double left = static_cast<double>(smeared) / static_cast<double>(steps);
    return std::clamp(1.0 - left, 0.0, 1.0);
  }
};

void LineSums::add(const std::vector<int>& line) {
  for (const int value : line) {
    sum += value;
    squares += value * value;
  }
  num += static_cast<std::int64_t>(line.size());
  // The difference of neighbouring means over a window is that of what enters and what leaves it.
  constexpr std::size_t kBefore = kMeanOver / 2 + 1;
  constexpr std::size_t kAfter = kMeanOver / 2;
  for (std::size_t i = kBefore; i + kAfter < line.size(); ++i) {
    const int step = static_cast<int>(kMeanOver) * std::abs(line[i] - line[i - 1]);
    steps += step;
    smeared += std::max(0, step - std::abs(line[i + kAfter] - line[i - kBefore]));
  }
}

int sum_of_four(const ImageView& image, int x, int y) {
  const std::uint8_t* above = image.row(y) + x;
  const std::uint8_t* below = image.row(y + 1) + x;
  return above[0] + above[1] + below[0] + below[1];
}

std::uint8_t rounded_to_byte(double value) {
  return static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
}

}  // namespace

ImageStatistics measure_image(ImageView image) {
  ImageStatistics figures;
  const int width = image.width_px / 2;
  const int height = image.height_px / 2;
  if (image.is_empty() || 2 * std::min(width, height) < kMinSidePx) return figures;
  LineSums rows, columns;
  std::vector<int> line;
  for (int i = 0; i < kNumLines; ++i) {
    const int y = 2 * ((2 * i + 1) * height / (2 * kNumLines));
    line.clear();
    for (int x = 0; x < width; ++x) line.push_back(sum_of_four(image, 2 * x, y));
    rows.add(line);
    const int x = 2 * ((2 * i + 1) * width / (2 * kNumLines));
    line.clear();
    for (int row = 0; row < height; ++row) line.push_back(sum_of_four(image, x, 2 * row));
    columns.add(line);
  }
  const auto num = static_cast<double>(rows.num + columns.num);
  const double mean = static_cast<double>(rows.sum + columns.sum) / num;
  const double variance = static_cast<double>(rows.squares + columns.squares) / num - mean * mean;
  figures.brightness = rounded_to_byte(0.25 * mean);
  figures.contrast = rounded_to_byte(0.25 * std::sqrt(std::max(0.0, variance)));
  figures.blur_percent = rounded_to_byte(100.0 * std::max(rows.blur(), columns.blur()));
  figures.is_known = true;
  return figures;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/distance_transform.h"

#include <cmath>
#include <limits>

namespace waymark {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

/// The lower envelope of parabolas (section 2.1): values[i] becomes the least of
/// values[k] + (i - k)^2. Those of infinite height never count.
class LineTransform {
 public:
  explicit LineTransform(std::size_t length) : apexes_(length), ends_(length), result_(length) {}

  void apply(float* values, std::size_t length, std::size_t stride) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < length; ++i) {
      const float height = values[i * stride];
      if (height == kFar) continue;
      while (count > 0 && meeting(values, stride, apexes_[count - 1], i) <= start(count - 1)) {
        --count;
      }
      if (count > 0) ends_[count - 1] = meeting(values, stride, apexes_[count - 1], i);
      apexes_[count++] = i;
    }
    if (count == 0) return;
    std::size_t k = 0;
    for (std::size_t i = 0; i < length; ++i) {
      while (k + 1 < count && ends_[k] < static_cast<double>(i)) ++k;
      const double apart = static_cast<double>(i) - static_cast<double>(apexes_[k]);
      result_[i] = values[apexes_[k] * stride] + static_cast<float>(apart * apart);
    }
    for (std::size_t i = 0; i < length; ++i) values[i * stride] = result_[i];
  }

 private:
  /// Where the parabola of k begins to be the lowest.
  double start(std::size_t k) const {
    return k == 0 ? -std::numeric_limits<double>::infinity() : ends_[k - 1];
  }
  static double meeting(const float* values, std::size_t stride, std::size_t a, std::size_t b) {
    const double p = static_cast<double>(a), q = static_cast<double>(b);
    return (values[b * stride] - values[a * stride] + q * q - p * p) / (2.0 * (q - p));
  }

  std::vector<std::size_t> apexes_;
  std::vector<double> ends_;
  std::vector<float> result_;
};

}  // namespace

std::vector<float> distances_to_zero(ImageView image) {
  const auto width = static_cast<std::size_t>(image.width_px);
  const auto height = static_cast<std::size_t>(image.height_px);
  std::vector<float> squared(width * height);
  for (std::size_t i = 0; i < squared.size(); ++i) {
    const int x = static_cast<int>(i % width), y = static_cast<int>(i / width);
    squared[i] = image.at(x, y) == 0 ? 0.0f : kFar;
  }
  LineTransform columns(height);
  for (std::size_t x = 0; x < width; ++x) columns.apply(squared.data() + x, height, width);
  LineTransform rows(width);
  for (std::size_t y = 0; y < height; ++y) rows.apply(squared.data() + y * width, width, 1);
  for (float& value : squared) value = std::sqrt(value);
  return squared;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/convert.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace waymark {
namespace {

/// The pixels in a row that a smaller one covers, and how much of each.
struct Cover {
  int first = 0;
  std::vector<float> weights;  ///< They add up to 1.
};

std::vector<Cover> covers(int size, double factor) {
  std::vector<Cover> result(static_cast<std::size_t>(factor * size));
  for (std::size_t i = 0; i < result.size(); ++i) {
    const double begin = static_cast<double>(i) / factor;
    const double end = std::min(static_cast<double>(i + 1) / factor, static_cast<double>(size));
    result[i].first = static_cast<int>(begin);
    for (int j = result[i].first; j < end; ++j) {
      const double overlap = std::min(end, j + 1.0) - std::max(begin, static_cast<double>(j));
      result[i].weights.push_back(static_cast<float>(overlap / (end - begin)));
    }
  }
  return result;
}

template <class T>
BasicImage<T> pick(const BasicImageView<T>& image, double factor) {
  BasicImage<T> result(static_cast<int>(factor * image.width_px),
                       static_cast<int>(factor * image.height_px));
  for (int y = 0; y < result.height_px; ++y) {
    const T* from = image.row(static_cast<int>((y + 0.5) / factor));
    for (int x = 0; x < result.width_px; ++x) {
      result.row(y)[x] = from[static_cast<int>((x + 0.5) / factor)];
    }
  }
  return result;
}

/// Means over squares of this side, 2 to 16: as of any factor, but several times faster.
Image reduce_squares(ImageView image, double factor, int side) {
  Image result(static_cast<int>(factor * image.width_px),
               static_cast<int>(factor * image.height_px));
  const auto used = static_cast<std::size_t>(result.width_px * side);
  const auto area = static_cast<unsigned>(side * side);
  std::vector<std::uint16_t> sums(used);
  for (int y = 0; y < result.height_px; ++y) {
    std::fill(sums.begin(), sums.end(), std::uint16_t{0});
    for (int k = 0; k < side; ++k) {
      const std::uint8_t* from = image.row(side * y + k);
      for (std::size_t x = 0; x < used; ++x) {
        sums[x] = static_cast<std::uint16_t>(sums[x] + from[x]);
      }
    }
    const std::uint16_t* next = sums.data();
    std::uint8_t* to = result.row(y);
    for (int x = 0; x < result.width_px; ++x, next += side) {
      unsigned sum = area / 2;
      for (int k = 0; k < side; ++k) sum += next[k];
      to[x] = static_cast<std::uint8_t>(sum / area);
    }
  }
  return result;
}

}  // namespace

Image to_grey(const ColorView& image) {
  // Weights of 15 bits, whose sum is 1.
  constexpr std::uint32_t kRed = 9798, kGreen = 19235, kBlue = 3735;
  constexpr int kBits = 15;
  constexpr std::uint32_t kHalf = 1u << (kBits - 1);
  Image grey(image.width_px, image.height_px);
  for (int y = 0; y < image.height_px; ++y) {
    const Rgb* from = image.row(y);
    std::uint8_t* to = grey.row(y);
    for (int x = 0; x < image.width_px; ++x) {
      const auto& [red, green, blue] = from[x];
      to[x] =
          static_cast<std::uint8_t>((kRed * red + kGreen * green + kBlue * blue + kHalf) >> kBits);
    }
  }
  return grey;
}

DepthImage depth_in_units(const BasicImageView<float>& depth_m, const DepthSettings& settings) {
  constexpr double kEnd = std::numeric_limits<std::uint16_t>::max() + 0.5;
  DepthImage result(depth_m.width_px, depth_m.height_px);
  for (int y = 0; y < depth_m.height_px; ++y) {
    const float* from = depth_m.row(y);
    std::uint16_t* to = result.row(y);
    for (int x = 0; x < depth_m.width_px; ++x) {
      const double units = settings.factor * static_cast<double>(from[x]);
      // False for what is not a number.
      to[x] = units > 0.0 && units < kEnd ? static_cast<std::uint16_t>(units + 0.5) : 0;
    }
  }
  return result;
}

Image reduce(ImageView image, double factor) {
  const double side = std::round(1.0 / factor);
  if (side >= 2.0 && side <= 16.0 && std::abs(factor * side - 1.0) < 1e-12) {
    return reduce_squares(image, factor, static_cast<int>(side));
  }
  const std::vector<Cover> columns = covers(image.width_px, factor);
  const std::vector<Cover> rows = covers(image.height_px, factor);
  Image result(static_cast<int>(columns.size()), static_cast<int>(rows.size()));
  std::vector<float> sums(static_cast<std::size_t>(image.width_px));
  for (int y = 0; y < result.height_px; ++y) {
    const Cover& row = rows[static_cast<std::size_t>(y)];
    std::fill(sums.begin(), sums.end(), 0.0f);
    for (std::size_t k = 0; k < row.weights.size(); ++k) {
      const std::uint8_t* from = image.row(row.first + static_cast<int>(k));
      for (std::size_t x = 0; x < sums.size(); ++x) sums[x] += row.weights[k] * from[x];
    }
    for (int x = 0; x < result.width_px; ++x) {
      const Cover& column = columns[static_cast<std::size_t>(x)];
      float sum = 0.0f;
      for (std::size_t k = 0; k < column.weights.size(); ++k) {
        sum += column.weights[k] * sums[static_cast<std::size_t>(column.first) + k];
      }
      result.row(y)[x] = static_cast<std::uint8_t>(std::lround(sum));
    }
  }
  return result;
}

Image pick_reduced(ImageView image, double factor) { return pick(image, factor); }

DepthImage pick_reduced(DepthView image, double factor) { return pick(image, factor); }

}  // namespace waymark

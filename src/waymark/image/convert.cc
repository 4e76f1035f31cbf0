// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/convert.h"

#include <limits>

namespace waymark {

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

}  // namespace waymark

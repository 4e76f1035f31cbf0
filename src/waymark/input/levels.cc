// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/levels.h"

#include <fmt/format.h>

#include <algorithm>

namespace waymark {
namespace {

constexpr double kNumbers = 65536.0;
constexpr double kWideShare = 0.25;
constexpr double kExtreme = 0.001;
/// Of what is spanned, on both sides: frames that were not looked at may be a little darker.
constexpr double kMargin = 0.05;
/// A number for each grey value: with less noise would become the picture.
constexpr double kNarrowest = 256.0;

}  // namespace

std::string Levels::describe() const {
  if (*this == Levels{}) return {};
  return fmt::format("16-bit images: {:.0f} is black, {:.0f} white", black, white);
}

GreyRangeEstimator::GreyRangeEstimator() : counts_(static_cast<std::size_t>(kNumbers)) {}

void GreyRangeEstimator::add(const BasicImage<std::uint16_t>& image) {
  for (const std::uint16_t value : image.values) ++counts_[value];
  num_pixels_ += image.values.size();
}

Levels GreyRangeEstimator::levels() const {
  if (num_pixels_ == 0) return {};
  const auto quantile = [&](double share) {
    const double wanted = share * static_cast<double>(num_pixels_);
    std::uint64_t sum = 0;
    std::size_t value = 0;
    while (value + 1 < counts_.size() && static_cast<double>(sum += counts_[value]) <= wanted)
      ++value;
    return static_cast<double>(value);
  };
  const double low = quantile(kExtreme);
  const double high = quantile(1.0 - kExtreme);
  if (high - low >= kWideShare * kNumbers) return {};
  const double span = std::max(high - low, kNarrowest / (1.0 + 2.0 * kMargin));
  const double middle = 0.5 * (low + high);
  const double half = (0.5 + kMargin) * span;
  return {std::max(0.0, middle - half), std::min(kNumbers - 1.0, middle + half)};
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>

#include "waymark/base/check.h"

namespace waymark {

/// The median of a vector, array or span of values; of an even number the upper of the two in the
/// middle. Reorders the values; there must be some.
template <class Values>
auto median(Values&& values) {
  WAYMARK_CHECK(!std::empty(values));
  const auto middle = std::begin(values) + static_cast<std::ptrdiff_t>(std::size(values) / 2);
  std::nth_element(std::begin(values), middle, std::end(values));
  return *middle;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/adjustment_interval.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>

namespace waymark {
namespace {

TEST(AdjustmentInterval, SmallMapsAreAdjustedAfterEachLoop) {
  AdjustmentInterval pace;
  for (const std::size_t num_keyframes : {10u, 500u, 501u, 2000u}) {
    EXPECT_TRUE(pace.is_due(num_keyframes)) << num_keyframes;
    pace.note(num_keyframes);
  }
}

// A loop every fifty keyframes: what is adjusted in all, in parts of the last map.
TEST(AdjustmentInterval, ManyLoopsOfALargeMapTakeFewAdjustments) {
  AdjustmentInterval pace;
  constexpr std::size_t kEnd = 50'000;
  double work = 0.0;
  std::size_t longest_wait = 0;
  std::size_t last = 2000;
  for (std::size_t n = 2050; n <= kEnd; n += 50) {
    if (!pace.is_due(n)) continue;
    longest_wait = std::max(longest_wait, (n - last) * kEnd / n);
    pace.note(n);
    work += static_cast<double>(n) / kEnd;
    last = n;
  }
  EXPECT_LT(work, 18.0);
  EXPECT_LT(longest_wait, kEnd / 12);
}

TEST(AdjustmentInterval, HurriesWhereItHasTo) {
  AdjustmentInterval pace;
  pace.note(10'000);
  EXPECT_FALSE(pace.is_due(10'001));
  pace.hurry();
  EXPECT_TRUE(pace.is_due(10'001));
}

}  // namespace
}  // namespace waymark

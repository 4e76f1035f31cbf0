// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/median.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "waymark/base/rng.h"

namespace waymark {
namespace {

TEST(Median, IsTheMiddleOne) {
  EXPECT_EQ(median(std::vector{3.0}), 3.0);
  EXPECT_EQ(median(std::vector{9, -1, 4}), 4);
  EXPECT_EQ(median(std::vector{7, 7, 1, 7, 2}), 7);
}

TEST(Median, OfAnEvenNumberIsTheUpperOfTheMiddle) {
  EXPECT_EQ(median(std::vector{2.0, 1.0}), 2.0);
  EXPECT_EQ(median(std::vector{4, 1, 3, 2}), 3);
}

TEST(Median, KeepsTheValues) {
  Rng rng(1, 2);
  for (std::size_t size = 1; size < 40; ++size) {
    std::vector<double> values(size);
    for (double& value : values) value = rng.uniform(-1.0, 1.0);
    std::vector<double> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(median(values), sorted[size / 2]);
    EXPECT_TRUE(std::is_permutation(values.begin(), values.end(), sorted.begin()));
  }
}

TEST(Median, LooksAtNothingBeyondASpan) {
  std::array<int, 5> values = {3, 1, 2, -9, -9};
  EXPECT_EQ(median(std::span(values).first(3)), 2);
  EXPECT_EQ(values[3], -9);
  EXPECT_EQ(values[4], -9);
}

TEST(Median, OfNothingIsABrokenPromise) { EXPECT_THROW(median(std::vector<double>{}), CheckError); }

}  // namespace
}  // namespace waymark

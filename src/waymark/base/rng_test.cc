// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/rng.h"

#include <gmock/gmock.h>

#include <cmath>
#include <set>

namespace waymark {
namespace {

TEST(Rng, RepeatsForTheSameSeedAndStreamOnly) {
  Rng a(1, 2), b(1, 2);
  std::set<std::uint64_t> seen;
  for (int i = 0; i < 100; ++i) {
    const std::uint64_t value = a.next();
    EXPECT_EQ(value, b.next());
    seen.insert(value);
  }
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    for (std::uint64_t stream = 0; stream < 4; ++stream) {
      if (seed == 1 && stream == 2) continue;
      EXPECT_EQ(seen.count(Rng(seed, stream).next()), 0u);
    }
  }
}

TEST(Rng, FillsTheRangeEvenly) {
  Rng rng(7, 0);
  std::vector<int> counts(10, 0);
  for (int i = 0; i < 100000; ++i) ++counts[rng.below(10)];
  for (const int count : counts) EXPECT_NEAR(count, 10000, 500);
  for (int i = 0; i < 1000; ++i) {
    const double value = rng.uniform(-2.0, 3.0);
    EXPECT_GE(value, -2.0);
    EXPECT_LT(value, 3.0);
  }
}

TEST(Rng, NormalHasItsMoments) {
  Rng rng(9, 0);
  double sum = 0.0, sum_of_squares = 0.0;
  constexpr int kNum = 100000;
  for (int i = 0; i < kNum; ++i) {
    const double value = rng.normal();
    ASSERT_TRUE(std::isfinite(value));
    sum += value;
    sum_of_squares += value * value;
  }
  EXPECT_NEAR(sum / kNum, 0.0, 0.02);
  EXPECT_NEAR(sum_of_squares / kNum, 1.0, 0.02);
}

}  // namespace
}  // namespace waymark

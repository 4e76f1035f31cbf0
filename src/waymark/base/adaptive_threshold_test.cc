// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/adaptive_threshold.h"

#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(AdaptiveThreshold, AsksForAllWhereTheImageOffersPlenty) {
  EXPECT_EQ(adaptive_threshold(80, 400), 80);
  EXPECT_EQ(adaptive_threshold(80, 100'000), 80);
}

TEST(AdaptiveThreshold, AsksForAFifthWhereItOffersLess) {
  EXPECT_EQ(adaptive_threshold(80, 300), 60);
  EXPECT_EQ(adaptive_threshold(30, 100), 20);
}

TEST(AdaptiveThreshold, NeverAsksForLessThanHalf) {
  EXPECT_EQ(adaptive_threshold(80, 0), 40);
  EXPECT_EQ(adaptive_threshold(25, 3), 13);
}

}  // namespace
}  // namespace waymark

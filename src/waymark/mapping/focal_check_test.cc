// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/focal_check.h"

#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(FocalCheck, SaysOfTheBendOnlyWhatHasAStandardDeviation) {
  FocalCheck check;
  check.sigma = 0.001;
  check.bend = 0.2;  // Where a search ended that was downhill all the way.
  EXPECT_FALSE(check.is_bent());
  check.bend_sigma = 0.01;
  EXPECT_TRUE(check.is_bent());
  check.factor = 1.1;
  EXPECT_FALSE(check.is_bent());
}

}  // namespace
}  // namespace waymark

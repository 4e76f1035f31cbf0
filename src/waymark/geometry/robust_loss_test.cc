// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/robust_loss.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace waymark {
namespace {

TEST(RobustLoss, WeightsAreDerivativesOfTheLoss) {
  const double step = 1e-6;
  for (const double s : {0.0, 0.5, 3.9, 4.1, 30.0, 1e4}) {
    const double low = std::max(0.0, s - step);
    const double width = s + step - low;
    const double huber_slope = (huber(s + step, 2.0).loss - huber(low, 2.0).loss) / width;
    EXPECT_NEAR(huber(s, 2.0).weight, huber_slope, 1e-5);
    const double redescending_slope =
        (geman_mcclure(s + step, 2.0).loss - geman_mcclure(low, 2.0).loss) / width;
    EXPECT_NEAR(geman_mcclure(s, 2.0).weight, redescending_slope, 1e-5);
  }
  EXPECT_LT(geman_mcclure(1e12, 2.0).loss, 4.0);
}

TEST(RobustLoss, WeightsByErrorAndBySquareAgree) {
  for (const float error : {0.0f, 1.9f, 2.1f, -30.0f}) {
    const double squared = static_cast<double>(error) * static_cast<double>(error);
    EXPECT_NEAR(huber_weight(error, 2.0f), huber(squared, 2.0).weight, 1e-6);
    EXPECT_EQ(geman_mcclure_weight(squared, 4.0), geman_mcclure(squared, 2.0).weight);
  }
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <cmath>

#include "waymark/features/fast.h"

namespace waymark {
namespace {

ScorePatch sample(double peak_x, double peak_y, double xx, double xy, double yy) {
  ScorePatch patch;
  for (int k = 0; k < 9; ++k) {
    const double x = k % 3 - 1 - peak_x;
    const double y = k / 3 - 1 - peak_y;
    const double score = 240.0 - (xx * x * x + 2.0 * xy * x * y + yy * y * y);
    patch[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(std::lround(score));
  }
  return patch;
}

TEST(LocatePeak, FindsThePeakOfAParaboloid) {
  for (double x : {-0.4, 0.0, 0.17, 0.45}) {
    for (double y : {-0.45, 0.05, 0.3}) {
      const SubpixelOffset offset = locate_peak(sample(x, y, 40.0, 12.0, 28.0));
      EXPECT_NEAR(offset.x_px, x, 0.02);
      EXPECT_NEAR(offset.y_px, y, 0.02);
    }
  }
}

TEST(LocatePeak, StaysWithinThePixel) {
  const SubpixelOffset offset = locate_peak(sample(1.3, -0.8, 20.0, 0.0, 20.0));
  EXPECT_EQ(offset.x_px, 0.5f);
  EXPECT_EQ(offset.y_px, -0.5f);
}

TEST(LocatePeak, KeepsThePixelWhereThereIsNoPeak) {
  const ScorePatch flat{50, 50, 50, 50, 50, 50, 50, 50, 50};
  const ScorePatch ridge{10, 50, 10, 10, 50, 10, 10, 50, 10};
  const ScorePatch saddle{50, 10, 50, 90, 50, 90, 50, 10, 50};
  for (const ScorePatch& patch : {flat, ridge, saddle}) {
    EXPECT_EQ(locate_peak(patch).x_px, 0.0f);
    EXPECT_EQ(locate_peak(patch).y_px, 0.0f);
  }
}

}  // namespace
}  // namespace waymark

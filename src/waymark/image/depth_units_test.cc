// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/depth_units.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace waymark {
namespace {

TEST(DepthUnits, RoundsAndLeavesOutWhatIsNoMeasurement) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  // Rows of five with one between them that is not part of the image.
  const std::vector<float> metres = {1.0f,
                                     2.00011f,
                                     0.00009f,
                                     0.0f,
                                     -1.0f,
                                     9.0f,  //
                                     kNan,
                                     kInfinity,
                                     13.107f,
                                     13.1072f,
                                     -kInfinity,
                                     9.0f};
  const DepthImage depth =
      depth_in_units({metres.data(), 5, 2, 6}, DepthSettings{.factor = 5000.0});
  EXPECT_EQ(depth.width_px, 5);
  EXPECT_EQ(depth.height_px, 2);
  EXPECT_THAT(depth.values, ::testing::ElementsAre(5000, 10001, 0, 0, 0, 0, 0, 65535, 0, 0));
}

}  // namespace
}  // namespace waymark

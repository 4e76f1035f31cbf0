// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/calibrate/image_circle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

namespace waymark {
namespace {

Image painted(int width, int height, const std::function<double(int x, int y)>& grey) {
  Image image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.row(y)[x] = static_cast<std::uint8_t>(grey(x, y));
  }
  return image;
}

TEST(Look, KnowsImagesOfAllDirectionsByTheirBorders) {
  const auto wave = [](double turns) {
    return [turns](int x, int y) {
      return 128.0 + 60.0 * std::cos(turns * 2.0 * M_PI * x / 200.0) + 40.0 * std::sin(0.1 * y);
    };
  };
  EXPECT_TRUE(are_equirectangular(std::vector{painted(200, 100, wave(3.0))}));
  EXPECT_FALSE(are_equirectangular(std::vector{painted(200, 100, wave(3.5))}));
  EXPECT_FALSE(are_equirectangular(std::vector{painted(200, 120, wave(3.0))}));
  EXPECT_FALSE(are_equirectangular({}));
}

TEST(Look, FindsTheImageCircle) {
  const auto inside = [](int x, int y) { return std::hypot(x - 103.0, y - 76.0) < 70.0; };
  // Dark places in the middle of the circle are lit in another image.
  std::vector<Image> images;
  for (int i = 0; i < 2; ++i) {
    images.push_back(painted(
        200, 150, [&](int x, int y) { return inside(x, y) && (y / 40) % 2 == i ? 150.0 : 5.0; }));
  }
  const auto circle = find_image_circle(images);
  ASSERT_TRUE(circle);
  EXPECT_NEAR(circle->center_px.x(), 103.0, 0.5);
  EXPECT_NEAR(circle->center_px.y(), 76.0, 0.5);
  EXPECT_NEAR(circle->radius_px, 70.0, 1.0);
}

TEST(Look, TakesNoOtherDarknessForACircle) {
  EXPECT_FALSE(find_image_circle({}));
  EXPECT_FALSE(find_image_circle(std::vector{painted(200, 150, [](int, int) { return 0.0; })}));
  EXPECT_FALSE(find_image_circle(std::vector{painted(200, 150, [](int, int) { return 90.0; })}));
  const auto bars = [](int x, int) { return x > 30 && x < 170 ? 90.0 : 0.0; };
  EXPECT_FALSE(find_image_circle(std::vector{painted(200, 150, bars)}));
  const auto corner = [](int x, int y) { return x + y > 80 ? 90.0 : 0.0; };
  EXPECT_FALSE(find_image_circle(std::vector{painted(200, 150, corner)}));
}

}  // namespace
}  // namespace waymark

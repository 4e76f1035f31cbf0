// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/pyramid.h"

#include <gmock/gmock.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "waymark/features/brief.h"
#include "waymark/features/pyramid.h"
#include "waymark/features/testing/references.h"
#include "waymark/image/image_testing.h"

namespace waymark {
namespace {

cv::Mat cv_view_of(const PaddedImage& image) {
  const ImageView view = image.view();
  return cv::Mat(view.height_px,
                 view.width_px,
                 CV_8U,
                 const_cast<std::uint8_t*>(view.data),
                 static_cast<std::size_t>(view.stride));
}

void expect_equal(const PaddedImage& a, const PaddedImage& b) {
  ASSERT_EQ(a.width_px(), b.width_px());
  ASSERT_EQ(a.height_px(), b.height_px());
  for (int y = 0; y < a.height_px(); ++y) {
    for (int x = 0; x < a.width_px(); ++x) {
      ASSERT_EQ(a.row(y)[x], b.row(y)[x]) << "at " << x << ", " << y;
    }
  }
}

TEST(Downscale, KernelIsEqualToReference) {
  DownscaleWorkspace workspace;
  PaddedImage result;
  PaddedImage reference;
  for (const auto& [width, height] : {std::pair(752, 48), {241, 37}, {64, 6}, {13, 13}, {7, 2}}) {
    const PaddedImage image = testing::make_noise(width, height, 3);
    downscale(image, workspace, result);
    testing::downscale(image, reference);
    expect_equal(result, reference);
  }
}

TEST(Downscale, InterpolatesAtItsPixelCentres) {
  PaddedImage image;
  image.resize(120, 60);
  const auto grey = [](double x, double y) { return 10.0 + 1.4142 * x + 0.7321 * y; };
  for (int y = 0; y < image.height_px(); ++y) {
    for (int x = 0; x < image.width_px(); ++x) {
      image.row(y)[x] = static_cast<std::uint8_t>(std::lround(grey(x, y)));
    }
  }
  DownscaleWorkspace workspace;
  PaddedImage result;
  downscale(image, workspace, result);
  double error = 0.0;
  for (int y = 0; y < result.height_px(); ++y) {
    for (int x = 0; x < result.width_px(); ++x) {
      const double expected = grey((x + 0.5) * 1.2 - 0.5, (y + 0.5) * 1.2 - 0.5);
      ASSERT_NEAR(result.row(y)[x], expected, 1.01);
      error += result.row(y)[x] - expected;
    }
  }
  // A shift by 0.1 pixels would make 0.2.
  EXPECT_NEAR(error / (result.width_px() * result.height_px()), 0.0, 0.03);
}

TEST(Pyramid, LevelsStayInPlace) {
  // The centroid of a smooth blob is the same point at all levels.
  constexpr double kX = 301.3;
  constexpr double kY = 203.8;
  PaddedImage image;
  image.resize(640, 480);
  for (int y = 0; y < image.height_px(); ++y) {
    for (int x = 0; x < image.width_px(); ++x) {
      const double squared = (x - kX) * (x - kX) + (y - kY) * (y - kY);
      image.row(y)[x] = static_cast<std::uint8_t>(std::lround(250.0 * std::exp(-squared / 450.0)));
    }
  }
  Pyramid pyramid;
  pyramid.build(image.view());
  for (int i = 0; i < Pyramid::kNumLevels; ++i) {
    const ImageView level = pyramid.level(i);
    double sum = 0.0;
    double sum_x = 0.0;
    double sum_y = 0.0;
    for (int y = 0; y < level.height_px; ++y) {
      for (int x = 0; x < level.width_px; ++x) {
        sum += level.at(x, y);
        sum_x += level.at(x, y) * static_cast<double>(x);
        sum_y += level.at(x, y) * static_cast<double>(y);
      }
    }
    EXPECT_NEAR(Pyramid::level0_from_level(sum_x / sum, i), kX, 0.01) << "level " << i;
    EXPECT_NEAR(Pyramid::level0_from_level(sum_y / sum, i), kY, 0.01) << "level " << i;
    EXPECT_NEAR(Pyramid::level_from_level0(Pyramid::level0_from_level(3.25, i), i), 3.25, 1e-9);
  }
}

TEST(Pyramid, CopesWithTinyAndLaterLargerImages) {
  Pyramid pyramid;
  for (int size : {1, 3, 100, 5}) {
    const PaddedImage image = testing::make_noise(size, size, 1);
    pyramid.build(image.view());
    int expected = size;
    for (int i = 0; i < Pyramid::kNumLevels; ++i, expected = expected * 5 / 6) {
      EXPECT_EQ(pyramid.level(i).width_px, expected);
      EXPECT_EQ(pyramid.level(i).height_px, expected);
    }
  }
}

TEST(GaussianBlur, KernelIsEqualToReference) {
  BlurWorkspace workspace;
  PaddedImage result;
  PaddedImage reference;
  for (const auto& [width, height] : {std::pair(320, 20), {37, 41}, {4, 4}}) {
    const PaddedImage image = testing::make_noise(width, height, 5);
    gaussian_blur(image, workspace, result);
    testing::gaussian_blur(image, reference);
    expect_equal(result, reference);
  }
}

TEST(GaussianBlur, AgreesWithOpenCv) {
  for (const PaddedImage& image :
       {testing::make_noise(333, 222, 5), testing::make_texture(333, 222, 5)}) {
    BlurWorkspace workspace;
    PaddedImage ours;
    gaussian_blur(image, workspace, ours);
    cv::Mat theirs;
    cv::GaussianBlur(cv_view_of(image), theirs, cv::Size(7, 7), 2.0, 2.0, cv::BORDER_REFLECT_101);
    cv::Mat difference;
    cv::absdiff(cv_view_of(ours), theirs, difference);
    EXPECT_LE(cv::norm(difference, cv::NORM_INF), 1.0);
    EXPECT_LE(cv::countNonZero(difference), 0.01 * static_cast<double>(difference.total()));
  }
}

}  // namespace
}  // namespace waymark

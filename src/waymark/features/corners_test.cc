// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/corners.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

#include "waymark/base/check.h"
#include "waymark/features/fast.h"
#include "waymark/features/testing/references.h"
#include "waymark/image/image_testing.h"

namespace waymark {
namespace {

constexpr int kBorder = 5;

bool is_before(const Corner& a, const Corner& b) {
  return a.y_px != b.y_px ? a.y_px < b.y_px : a.x_px < b.x_px;
}

std::vector<Corner> find(const PaddedImage& image, int min_contrast, double density) {
  CornerWorkspace workspace;
  std::vector<Corner> buffer;
  const auto corners = find_corners(image, {kBorder, min_contrast, density}, workspace, buffer);
  std::vector<Corner> sorted(corners.begin(), corners.end());
  std::sort(sorted.begin(), sorted.end(), is_before);
  return sorted;
}

// By the definition.
std::vector<Corner> find_reference(const PaddedImage& image, int min_contrast) {
  const auto score = [&](int x, int y) { return testing::fast_score(image.view(), x, y); };
  std::vector<Corner> corners;
  for (int y = kBorder; y < image.height_px() - kBorder; ++y) {
    for (int x = kBorder; x < image.width_px() - kBorder; ++x) {
      const int own = score(x, y);
      bool is_maximum = own > min_contrast;
      for (int i = 0; is_maximum && i < 9; ++i) {
        const int other = score(x + i % 3 - 1, y + i / 3 - 1);
        if (i < 4 && other > own) is_maximum = false;
        if (i > 4 && other >= own) is_maximum = false;
      }
      if (!is_maximum) continue;
      corners.push_back({static_cast<std::uint16_t>(x),
                         static_cast<std::uint16_t>(y),
                         static_cast<std::uint8_t>(own)});
    }
  }
  return corners;
}

TEST(FindCorners, FindsAllMaximaAndOneOfEqualNeighbours) {
  for (const PaddedImage& image : {testing::make_texture(203, 81, 1),
                                   testing::make_noise(150, 47, 2),
                                   testing::make_texture(11, 11, 3)}) {
    for (int min_contrast : {1, 7, 20, 45}) {
      EXPECT_EQ(find(image, min_contrast, 1.0), find_reference(image, min_contrast));
    }
  }
}

TEST(FindCorners, AgreesWithOpenCv) {
  const PaddedImage image = testing::make_texture(333, 207, 4);
  const cv::Mat wrapped(image.height_px(),
                        image.width_px(),
                        CV_8U,
                        const_cast<std::uint8_t*>(image.row(0)),
                        static_cast<std::size_t>(image.stride()));
  for (int threshold : {5, 25}) {
    std::vector<cv::KeyPoint> keypoints;
    cv::FAST(wrapped, keypoints, threshold, true, cv::FastFeatureDetector::TYPE_9_16);
    const std::vector<Corner> corners = find(image, threshold, 1.0);
    int num_checked = 0;
    for (const cv::KeyPoint& k : keypoints) {
      // OpenCV scores the largest threshold at which a pixel is a corner: one less.
      const Corner expected{static_cast<std::uint16_t>(k.pt.x),
                            static_cast<std::uint16_t>(k.pt.y),
                            static_cast<std::uint8_t>(k.response + 1.0f)};
      if (std::min(expected.x_px, expected.y_px) < kBorder) continue;
      if (expected.x_px >= image.width_px() - kBorder) continue;
      if (expected.y_px >= image.height_px() - kBorder) continue;
      EXPECT_THAT(corners, ::testing::Contains(expected));
      ++num_checked;
    }
    EXPECT_GT(num_checked, 100);
    // OpenCV drops both of two equal neighbours.
    EXPECT_LT(corners.size(), 1.3 * num_checked);
  }
}

TEST(FindCorners, TakesWeakCornersOnlyWhereStrongOnesAreTooFew) {
  // Strong texture above, the same at a quarter of the contrast below.
  PaddedImage image = testing::make_texture(200, 20 * kBorder + 160, 5);
  const int middle = image.height_px() / 2;
  for (int y = middle; y < image.height_px(); ++y) {
    for (int x = 0; x < image.width_px(); ++x) {
      image.row(y)[x] = static_cast<std::uint8_t>(100 + image.row(y - middle)[x] / 8);
    }
  }
  const std::vector<Corner> corners = find(image, 5, 0.001);
  int num_weak_above = 0;
  int num_weak_below = 0;
  for (const Corner& corner : corners) {
    if (corner.score > kStrongContrast) continue;
    ++(corner.y_px < middle - 40 ? num_weak_above : num_weak_below);
  }
  EXPECT_EQ(num_weak_above, 0);
  EXPECT_GT(num_weak_below, 50);
}

TEST(FindCorners, RejectsABorderWithinTheRing) {
  CornerWorkspace workspace;
  std::vector<Corner> buffer;
  const PaddedImage image = testing::make_noise(20, 20, 1);
  EXPECT_THROW(find_corners(image, {.border_px = 3}, workspace, buffer), CheckError);
  EXPECT_TRUE(find_corners(image, {.border_px = 10}, workspace, buffer).empty());
}

}  // namespace
}  // namespace waymark

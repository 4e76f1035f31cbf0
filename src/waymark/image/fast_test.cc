// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/fast.h"

#include <gmock/gmock.h>

#include <map>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/image/image_testing.h"

namespace waymark {
namespace {

constexpr int kMargin = kFastRadius;

bool is_within(int x, int y, const PaddedImage& image, int margin) {
  return x >= margin && y >= margin && x < image.width_px() - margin &&
         y < image.height_px() - margin;
}

class Fast : public ::testing::TestWithParam<int> {
 protected:
  const int min_contrast_ = GetParam();
};

TEST_P(Fast, ScoresAreEqualToReference) {
  for (const PaddedImage& image : {testing::make_noise(150, 40, 1),
                                   testing::make_texture(203, 61, 2),
                                   testing::make_texture(9, 9, 3)}) {
    PaddedImage scores;
    fast_scores(image, kMargin, min_contrast_, scores);
    for (int y = kMargin; y < image.height_px() - kMargin; ++y) {
      for (int x = kMargin; x < image.width_px() - kMargin; ++x) {
        const int expected = fast_score_reference(image.view(), x, y);
        ASSERT_EQ(scores.row(y)[x], expected > min_contrast_ ? expected : 0) << x << ", " << y;
      }
    }
  }
}

TEST_P(Fast, CornersAreEqualToOpenCv) {
  const PaddedImage image = testing::make_texture(333, 207, 4);
  const cv::Mat wrapped(image.height_px(),
                        image.width_px(),
                        CV_8U,
                        const_cast<std::uint8_t*>(image.row(0)),
                        static_cast<std::size_t>(image.stride()));
  // OpenCV scores the largest threshold at which a pixel is a corner: one less.
  std::map<std::pair<int, int>, int> expected;
  std::vector<cv::KeyPoint> keypoints;
  cv::FAST(wrapped, keypoints, min_contrast_, false, cv::FastFeatureDetector::TYPE_9_16);
  for (const cv::KeyPoint& k : keypoints) {
    expected[{static_cast<int>(k.pt.x), static_cast<int>(k.pt.y)}] = 0;
  }
  PaddedImage scores;
  fast_scores(image, kMargin, min_contrast_, scores);
  std::map<std::pair<int, int>, int> found;
  for (int y = kMargin; y < image.height_px() - kMargin; ++y) {
    for (int x = kMargin; x < image.width_px() - kMargin; ++x) {
      if (scores.row(y)[x] > min_contrast_) found[{x, y}] = 0;
    }
  }
  EXPECT_EQ(found, expected);
  ASSERT_GT(found.size(), 100u);

  cv::FAST(wrapped, keypoints, min_contrast_, true, cv::FastFeatureDetector::TYPE_9_16);
  std::vector<Corner> buffer;
  for (const Corner& c : find_corners(scores, kMargin, min_contrast_, buffer)) {
    found[{c.x_px, c.y_px}] = c.score - 1;
  }
  int num_checked = 0;
  for (const cv::KeyPoint& k : keypoints) {
    const auto x = static_cast<int>(k.pt.x);
    const auto y = static_cast<int>(k.pt.y);
    if (!is_within(x, y, image, kMargin + 1)) continue;
    EXPECT_EQ((found[{x, y}]), static_cast<int>(k.response)) << "at " << x << ", " << y;
    ++num_checked;
  }
  EXPECT_GT(num_checked, 100);
}

TEST_P(Fast, FindsAllMaximaAndOneOfEqualNeighbours) {
  PaddedImage scores = testing::make_noise(141, 50, 6);
  for (int y = 0; y < scores.height_px(); ++y) {
    for (int x = 0; x < scores.width_px(); ++x) scores.row(y)[x] &= 0x3f;
  }
  std::vector<Corner> expected;
  for (int y = kMargin + 1; y < scores.height_px() - kMargin - 1; ++y) {
    for (int x = kMargin + 1; x < scores.width_px() - kMargin - 1; ++x) {
      const int score = scores.row(y)[x];
      bool is_maximum = score > min_contrast_;
      for (int i = 0; i < 9; ++i) {
        const int other = scores.row(y + i / 3 - 1)[x + i % 3 - 1];
        if (i < 4 && other > score) is_maximum = false;
        if (i > 4 && other >= score) is_maximum = false;
      }
      if (is_maximum) {
        expected.push_back({static_cast<std::uint16_t>(x),
                            static_cast<std::uint16_t>(y),
                            static_cast<std::uint8_t>(score)});
      }
    }
  }
  std::vector<Corner> buffer;
  const std::span<Corner> corners = find_corners(scores, kMargin, min_contrast_, buffer);
  EXPECT_EQ(std::vector<Corner>(corners.begin(), corners.end()), expected);
}

INSTANTIATE_TEST_SUITE_P(Contrasts, Fast, ::testing::Values(1, 7, 20, 60));

TEST(FastInput, RejectsAMarginWithinTheRing) {
  PaddedImage image = testing::make_noise(20, 20, 1);
  PaddedImage scores;
  EXPECT_THROW(fast_scores(image, 2, 7, scores), CheckError);
}

}  // namespace
}  // namespace waymark

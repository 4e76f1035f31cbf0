// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/fast.h"

#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <set>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/features/testing/references.h"
#include "waymark/image/image_testing.h"

namespace waymark {
namespace {

Window all_of(const PaddedImage& image) {
  return {kFastRadius,
          kFastRadius,
          image.width_px() - 2 * kFastRadius,
          image.height_px() - 2 * kFastRadius};
}

class Fast : public ::testing::TestWithParam<int> {
 protected:
  const int min_contrast_ = GetParam();
};

TEST_P(Fast, ScoresAreEqualToReference) {
  for (const PaddedImage& image : {testing::make_noise(150, 40, 1),
                                   testing::make_texture(203, 61, 2),
                                   testing::make_texture(9, 9, 3)}) {
    for (const Window& window : {all_of(image), Window{4, 5, 2, 1}}) {
      PaddedImage scores;
      fast_scores(image, window, min_contrast_, scores);
      ASSERT_EQ(scores.width_px(), window.width_px);
      ASSERT_EQ(scores.height_px(), window.height_px);
      for (int y = 0; y < window.height_px; ++y) {
        for (int x = 0; x < window.width_px; ++x) {
          const int score = testing::fast_score(image.view(), window.x_px + x, window.y_px + y);
          ASSERT_EQ(scores.row(y)[x], score > min_contrast_ ? score : 0) << x << ", " << y;
        }
      }
    }
  }
}

TEST_P(Fast, CornersAreThoseOfOpenCv) {
  const PaddedImage image = testing::make_texture(333, 207, 4);
  const cv::Mat wrapped(image.height_px(),
                        image.width_px(),
                        CV_8U,
                        const_cast<std::uint8_t*>(image.row(0)),
                        static_cast<std::size_t>(image.stride()));
  std::vector<cv::KeyPoint> keypoints;
  cv::FAST(wrapped, keypoints, min_contrast_, false, cv::FastFeatureDetector::TYPE_9_16);
  std::set<std::pair<int, int>> expected;
  for (const cv::KeyPoint& k : keypoints) {
    expected.emplace(static_cast<int>(k.pt.x), static_cast<int>(k.pt.y));
  }
  PaddedImage scores;
  fast_scores(image, all_of(image), min_contrast_, scores);
  std::set<std::pair<int, int>> found;
  for (int y = 0; y < scores.height_px(); ++y) {
    for (int x = 0; x < scores.width_px(); ++x) {
      if (scores.row(y)[x] != 0) found.emplace(x + kFastRadius, y + kFastRadius);
    }
  }
  EXPECT_EQ(found, expected);
  EXPECT_GT(found.size(), 100u);
}

INSTANTIATE_TEST_SUITE_P(Contrasts, Fast, ::testing::Values(0, 1, 7, 20, 60));

TEST(FastScorePatches, AreEqualToReference) {
  const PaddedImage image = testing::make_texture(60, 50, 5);
  const std::vector<Corner> corners{{4, 4, 1}, {30, 20, 1}, {55, 45, 1}, {17, 33, 1}};
  std::vector<ScorePatch> patches(corners.size());
  fast_score_patches(image, corners, patches);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (int k = 0; k < 9; ++k) {
      EXPECT_EQ(patches[i][static_cast<std::size_t>(k)],
                testing::fast_score(
                    image.view(), corners[i].x_px + k % 3 - 1, corners[i].y_px + k / 3 - 1));
    }
  }
}

TEST(FastInput, RejectsWindowsWithoutRoomForTheRing) {
  const PaddedImage image = testing::make_noise(20, 20, 1);
  PaddedImage scores;
  EXPECT_THROW(fast_scores(image, {2, 3, 5, 5}, 7, scores), CheckError);
  EXPECT_THROW(fast_scores(image, {3, 3, 5, 15}, 7, scores), CheckError);
}

}  // namespace
}  // namespace waymark

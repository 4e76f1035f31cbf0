// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/brief.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

#include "waymark/features/brief_pattern.h"
#include "waymark/features/corners.h"
#include "waymark/features/hamming.h"
#include "waymark/features/testing/references.h"
#include "waymark/image/image_testing.h"

namespace waymark {
namespace {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;

cv::Mat as_cv(const PaddedImage& image) {
  const ImageView view = image.view();
  return cv::Mat(view.height_px,
                 view.width_px,
                 CV_8U,
                 const_cast<std::uint8_t*>(view.data),
                 static_cast<std::size_t>(view.stride));
}

cv::Ptr<cv::ORB> make_one_level_orb() {
  return cv::ORB::create(5000, 1.2f, 1, kBriefRadius, 0, 2, cv::ORB::HARRIS_SCORE, 31, 10);
}

std::vector<Corner> corners_within(const PaddedImage& image) {
  CornerWorkspace workspace;
  std::vector<Corner> buffer;
  const CornerRequest request{.border_px = kBriefRadius, .min_contrast = 15, .density = 1.0};
  const auto corners = find_corners(image, request, workspace, buffer);
  return {corners.begin(), corners.end()};
}

TEST(Orientation, KernelIsEqualToReference) {
  const PaddedImage image = testing::make_texture(200, 90, 1);
  const std::vector<Corner> corners = corners_within(image);
  std::vector<float> angles(corners.size());
  orient(image, corners, angles);
  ASSERT_GT(corners.size(), 50u);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    EXPECT_EQ(angles[i], testing::orientation(image.view(), corners[i].x_px, corners[i].y_px));
  }
}

TEST(Orientation, PointsToTheBrightSide) {
  for (double angle : {-3.0, -2.0, -0.7, 0.0, 0.4, 1.2, 2.5}) {
    PaddedImage image;
    image.resize(61, 61);
    for (int y = 0; y < 61; ++y) {
      for (int x = 0; x < 61; ++x) {
        const double along = (x - 30) * std::cos(angle) + (y - 30) * std::sin(angle);
        image.row(y)[x] = static_cast<std::uint8_t>(std::lround(128.0 + 2.5 * along));
      }
    }
    float found = 0.0f;
    orient(image, std::vector<Corner>{{30, 30, 1}}, {&found, 1});
    EXPECT_NEAR(found, angle, 0.01);
  }
}

TEST(Orientation, HoldsWhereMomentsAreLargest) {
  PaddedImage image;
  image.resize(40, 40);
  for (int y = 0; y < 40; ++y) std::fill_n(image.row(y), 40, y > 20 ? 255 : 0);
  float found = 0.0f;
  orient(image, std::vector<Corner>{{20, 20, 1}}, {&found, 1});
  EXPECT_NEAR(found, std::numbers::pi / 2, 1e-6);
}

TEST(Orientation, AgreesWithOpenCv) {
  const PaddedImage image = testing::make_texture(400, 300, 2);
  std::vector<cv::KeyPoint> keypoints;
  make_one_level_orb()->detect(as_cv(image), keypoints);
  ASSERT_GT(keypoints.size(), 100u);
  for (const cv::KeyPoint& k : keypoints) {
    const auto x = static_cast<int>(k.pt.x);
    const auto y = static_cast<int>(k.pt.y);
    const double angle_deg = testing::orientation(image.view(), x, y) * kDegPerRad;
    // OpenCV approximates the arc tangent to about 0.3 degrees.
    EXPECT_NEAR(std::remainder(angle_deg - k.angle, 360.0), 0.0, 0.3);
  }
}

TEST(Brief, KernelIsEqualToReference) {
  const PaddedImage smooth = testing::make_texture(200, 90, 1);
  const std::vector<Corner> corners = corners_within(smooth);
  std::vector<float> angles;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    angles.push_back(static_cast<float>(0.37 * static_cast<double>(i) - 9.0));
  }
  std::vector<Descriptor> descriptors(corners.size());
  describe(smooth, corners, angles, descriptors);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    EXPECT_EQ(descriptors[i],
              testing::descriptor(smooth.view(), corners[i].x_px, corners[i].y_px, angles[i]));
  }
}

TEST(Brief, StaysWithinItsRadius) {
  const PaddedImage smooth = testing::make_noise(2 * kBriefRadius + 1, 2 * kBriefRadius + 1, 1);
  for (int step = 0; step < 720; ++step) {
    const auto angle = static_cast<float>(step * std::numbers::pi / 360.0);
    for (const BriefTest& test : kBriefPattern) {
      for (const auto& [x, y] : {std::pair(test.x0, test.y0), std::pair(test.x1, test.y1)}) {
        EXPECT_LE(std::abs(std::lround(x * std::cos(angle) - y * std::sin(angle))), kBriefRadius);
      }
    }
  }
}

TEST(Brief, BitsAreThoseOfOpenCv) {
  const PaddedImage image = testing::make_texture(400, 300, 3);
  const std::vector<Corner> corners = corners_within(image);
  std::vector<float> angles(corners.size());
  orient(image, corners, angles);
  BlurWorkspace workspace;
  PaddedImage smooth;
  gaussian_blur(image, workspace, smooth);
  std::vector<Descriptor> ours(corners.size());
  describe(smooth, corners, angles, ours);

  std::vector<cv::KeyPoint> keypoints;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    keypoints.emplace_back(static_cast<float>(corners[i].x_px),
                           static_cast<float>(corners[i].y_px),
                           31.0f,
                           static_cast<float>(angles[i] * kDegPerRad),
                           0.0f,
                           0,
                           static_cast<int>(i));
  }
  cv::Mat theirs;
  make_one_level_orb()->compute(as_cv(image), keypoints, theirs);
  ASSERT_GT(keypoints.size(), 500u);
  double num_different = 0.0;
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    Descriptor descriptor;
    std::memcpy(descriptor.data(), theirs.ptr(static_cast<int>(i)), sizeof(descriptor));
    num_different +=
        hamming_distance(descriptor, ours[static_cast<std::size_t>(keypoints[i].class_id)]);
  }
  RecordProperty("bits_different",
                 std::to_string(num_different / static_cast<double>(keypoints.size())));
  EXPECT_LE(num_different, 0.002 * kDescriptorBits * static_cast<double>(keypoints.size()));
}

}  // namespace
}  // namespace waymark

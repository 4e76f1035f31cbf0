// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/extractor.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "waymark/base/check.h"
#include "waymark/base/median.h"
#include "waymark/base/rng.h"
#include "waymark/base/testing/allocation_count.h"
#include "waymark/features/corners.h"
#include "waymark/image/image_testing.h"

namespace waymark {
namespace {

struct Extracted {
  std::vector<Keypoint> keypoints;
  std::vector<Descriptor> descriptors;
  std::size_t num_edges = 0;
};

Extracted extract(FeatureExtractor& extractor, const PaddedImage& image, ImageView mask = {}) {
  Extracted result;
  result.num_edges = extractor.extract(image.view(), mask, result.keypoints, result.descriptors);
  return result;
}

TEST(FeatureExtractor, ReturnsWhatIsAskedForWithinTheImage) {
  for (const auto& [width, height] : {std::pair(752, 480), {1241, 376}, {301, 1003}}) {
    const PaddedImage image = testing::make_texture(width, height, 1);
    for (int count : {100, 1000, 1500}) {
      FeatureExtractor extractor({.count = count});
      const Extracted features = extract(extractor, image);
      EXPECT_EQ(features.keypoints.size(), static_cast<std::size_t>(count));
      EXPECT_EQ(features.descriptors.size(), features.keypoints.size());
      std::array<int, Pyramid::kNumLevels> num_at{};
      for (const Keypoint& keypoint : features.keypoints) {
        EXPECT_GT(keypoint.x_px, 18.0f);
        EXPECT_GT(keypoint.y_px, 18.0f);
        EXPECT_LT(keypoint.x_px, static_cast<float>(width) - 18.0f);
        EXPECT_LT(keypoint.y_px, static_cast<float>(height) - 18.0f);
        ++num_at[keypoint.level];
      }
      for (std::size_t i = 1; i < num_at.size(); ++i)
        EXPECT_NEAR(num_at[i] * 1.2, num_at[i - 1], 2);
    }
  }
}

TEST(FeatureExtractor, DoesNotDependOnWhatItSawBefore) {
  const PaddedImage image = testing::make_texture(400, 300, 1);
  FeatureExtractor fresh({.count = 500});
  const Extracted expected = extract(fresh, image);
  FeatureExtractor used({.count = 500});
  extract(used, testing::make_noise(640, 480, 2));
  extract(used, testing::make_texture(300, 400, 3));
  const Extracted features = extract(used, image);
  EXPECT_EQ(features.descriptors, expected.descriptors);
  ASSERT_EQ(features.keypoints.size(), expected.keypoints.size());
  for (std::size_t i = 0; i < expected.keypoints.size(); ++i) {
    EXPECT_EQ(features.keypoints[i].x_px, expected.keypoints[i].x_px);
    EXPECT_EQ(features.keypoints[i].y_px, expected.keypoints[i].y_px);
    EXPECT_EQ(features.keypoints[i].angle_rad, expected.keypoints[i].angle_rad);
    EXPECT_EQ(features.keypoints[i].level, expected.keypoints[i].level);
  }
}

TEST(FeatureExtractor, AllocatesNothingAfterTheFirstImage) {
  const std::array<PaddedImage, 3> images{testing::make_texture(400, 300, 1),
                                          testing::make_noise(400, 300, 2),
                                          testing::make_texture(400, 300, 3)};
  PaddedImage flat;
  flat.resize(400, 300);
  FeatureExtractor extractor({.count = 800});
  std::vector<Keypoint> keypoints;
  std::vector<Descriptor> descriptors;
  extractor.extract(flat.view(), {}, keypoints, descriptors);
  const long before = testing::num_allocations();
  for (const PaddedImage& image : images) {
    extractor.extract(image.view(), {}, keypoints, descriptors);
    EXPECT_EQ(keypoints.size(), 800u);
  }
  EXPECT_EQ(testing::num_allocations() - before, 0);
}

// Every fourth pixel of an image, from the given column on, after averaging 4x4 pixels.
PaddedImage reduce_by_four(const PaddedImage& image, int first_column) {
  PaddedImage reduced;
  reduced.resize(image.width_px() / 4 - 1, image.height_px() / 4);
  for (int y = 0; y < reduced.height_px(); ++y) {
    for (int x = 0; x < reduced.width_px(); ++x) {
      int sum = 8;
      for (int i = 0; i < 16; ++i) sum += image.row(4 * y + i / 4)[4 * x + first_column + i % 4];
      reduced.row(y)[x] = static_cast<std::uint8_t>(sum / 16);
    }
  }
  return reduced;
}

TEST(FeatureExtractor, LocatesToFractionsOfAPixel) {
  const PaddedImage fine = testing::make_texture(1600, 1200, 1, 4);
  FeatureExtractor extractor({.count = 1000});
  const Extracted first = extract(extractor, reduce_by_four(fine, 0));
  for (int shift : {1, 2, 3}) {
    const Extracted second = extract(extractor, reduce_by_four(fine, shift));
    std::vector<double> errors;
    for (const Keypoint& a : first.keypoints) {
      for (const Keypoint& b : second.keypoints) {
        if (a.level != b.level) continue;
        const double scale = Pyramid::scale(a.level);
        const double error_x = (b.x_px - a.x_px + 0.25 * shift) / scale;
        const double error_y = (b.y_px - a.y_px) / scale;
        if (std::hypot(error_x, error_y) > 1.0) continue;
        errors.push_back(std::abs(error_x));
        errors.push_back(std::abs(error_y));
      }
    }
    ASSERT_GT(errors.size(), 1000u);
    EXPECT_LT(median(errors), 0.1) << "at a shift of " << shift << " / 4 pixels";
  }
}

TEST(FeatureExtractor, HonoursMasks) {
  const PaddedImage image = testing::make_texture(400, 300, 1);
  Image mask(400, 300);
  for (int y = 0; y < 300; ++y) std::fill(mask.row(y) + 200, mask.row(y) + 400, 255);
  FeatureExtractor extractor({.count = 500});
  const Extracted features = extract(extractor, image, mask.view());
  EXPECT_EQ(features.keypoints.size(), 500u);
  for (const Keypoint& keypoint : features.keypoints) {
    // Up to half a pixel of the coarsest level for the sub-pixel part.
    EXPECT_GT(keypoint.x_px, 199.0f - 1.8f);
  }
}

/// A wall with a poster in one corner, and a door.
PaddedImage make_blank_wall() {
  PaddedImage image = testing::make_texture(640, 480, 4, 2);
  for (int y = 0; y < 480; ++y) {
    for (int x = y < 120 ? 160 : 0; x < 640; ++x) {
      image.row(y)[x] = x > 300 && x < 480 && y > 200 ? 120 : 160;
    }
  }
  return image;
}

TEST(FeatureExtractor, AddsPointsOnEdgesWhereCornersAreFew) {
  FeatureExtractor extractor({.edges = true});
  const Extracted features = extract(extractor, make_blank_wall());
  ASSERT_GT(features.num_edges, 30u);
  ASSERT_EQ(features.descriptors.size(), features.keypoints.size());
  int num_of_door = 0;
  for (std::size_t i = features.keypoints.size() - features.num_edges;
       i < features.keypoints.size();
       ++i) {
    const Keypoint& keypoint = features.keypoints[i];
    const double side = std::min(std::abs(keypoint.x_px - 300.5), std::abs(keypoint.x_px - 479.5));
    num_of_door += std::min(side, std::abs(keypoint.y_px - 200.5)) < 0.5;
  }
  EXPECT_GT(num_of_door, 30);
  FeatureExtractor without({.edges = false});
  EXPECT_EQ(extract(without, make_blank_wall()).num_edges, 0u);
  EXPECT_EQ(extract(extractor, testing::make_texture(640, 480, 4, 2)).num_edges, 0u);
}

TEST(FeatureExtractor, HasFewerCornersOnEdges) {
  PaddedImage wall = make_blank_wall();
  Rng rng(5, 0);
  for (int y = 0; y < wall.height_px(); ++y) {
    for (int x = 0; x < wall.width_px(); ++x) {
      const long grey = std::lround(wall.row(y)[x] + 3.0 * rng.normal());
      wall.row(y)[x] = static_cast<std::uint8_t>(std::clamp(grey, 0l, 255l));
    }
  }
  // On the sides of the door, far from its corners.
  const auto count_on_door = [](const Extracted& features) {
    int count = 0;
    for (std::size_t i = 0; i < features.keypoints.size() - features.num_edges; ++i) {
      const Keypoint& corner = features.keypoints[i];
      const double side = std::min(std::abs(corner.x_px - 300.5), std::abs(corner.x_px - 479.5));
      const bool is_weak = corner.response < static_cast<float>(kStrongContrast);
      count += is_weak && side < 2.0 && corner.y_px > 250.0f;
    }
    return count;
  };
  FeatureExtractor with({.edges = true});
  FeatureExtractor without({.edges = false});
  const int num_without = count_on_door(extract(without, wall));
  EXPECT_GT(num_without, 10);
  // Those that lie in the cell beside their edge stay.
  EXPECT_LE(count_on_door(extract(with, wall)), num_without / 2);
}

TEST(FeatureExtractor, KeepsTheCornersOfWhatIsDark) {
  // Tiles that are a little lighter than the wall: their corners are weak, and beside edges.
  constexpr int kTilePx = 45;
  PaddedImage wall;
  wall.resize(640, 480);
  for (int y = 0; y < wall.height_px(); ++y) {
    for (int x = 0; x < wall.width_px(); ++x) {
      wall.row(y)[x] = x / kTilePx % 2 == 1 && y / kTilePx % 2 == 1 ? 42 : 30;
    }
  }
  const auto num_corners = [](const Extracted& features) {
    return features.keypoints.size() - features.num_edges;
  };
  FeatureExtractor with({.edges = true});
  FeatureExtractor without({.edges = false});
  const Extracted features = extract(with, wall);
  EXPECT_GT(features.num_edges, 10u);
  const std::size_t num_without = num_corners(extract(without, wall));
  EXPECT_GT(num_without, 100u);
  EXPECT_GT(4 * num_corners(features), 3 * num_without);
}

TEST(FeatureExtractor, AddsNoEdgesWhereTheMaskIs) {
  Image mask(640, 480);
  for (int y = 0; y < 480; ++y) {
    for (int x = 0; x < 640; ++x) mask.row(y)[x] = x < 400 ? 8 : 0;
  }
  FeatureExtractor extractor({.edges = true});
  const Extracted features = extract(extractor, make_blank_wall(), mask.view());
  EXPECT_GT(features.num_edges, 10u);
  for (const Keypoint& keypoint : features.keypoints) EXPECT_LT(keypoint.x_px, 402.0f);
}

TEST(FeatureExtractor, FindsNothingWhereThereIsNothing) {
  PaddedImage flat;
  flat.resize(400, 300);
  FeatureExtractor extractor({.count = 500});
  EXPECT_TRUE(extract(extractor, flat).keypoints.empty());
  for (int size : {1, 2, 20, 39}) {
    EXPECT_LE(extract(extractor, testing::make_noise(size, size, 1)).keypoints.size(), 1u);
  }
  const Image mask(400, 300);  // All 0.
  EXPECT_TRUE(extract(extractor, testing::make_noise(400, 300, 1), mask.view()).keypoints.empty());
}

TEST(FeatureExtractor, RejectsBadInput) {
  const PaddedImage image = testing::make_noise(100, 80, 1);
  FeatureExtractor extractor({});
  EXPECT_THROW(extract(extractor, PaddedImage()), InputError);
  EXPECT_THROW(extract(extractor, image, Image(80, 100).view()), InputError);
}

}  // namespace
}  // namespace waymark

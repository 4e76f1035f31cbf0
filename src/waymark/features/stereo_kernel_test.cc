// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/stereo_kernel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/image/padded_image.h"

namespace waymark {
namespace {

PaddedImage random_image(int low, int high) {
  PaddedImage image;
  image.resize(80, 60);
  Rng rng(1, 2);
  for (int y = 0; y < image.height_px(); ++y) {
    for (int x = 0; x < image.width_px(); ++x) {
      image.row(y)[x] =
          static_cast<std::uint8_t>(low + static_cast<int>(rng.below(high - low + 1)));
    }
  }
  return image;
}

SearchPatch cut(ImageView image, PatchCorner corner) {
  SearchPatch patch;
  for (int k = 0; k < kSearchArea; ++k) {
    patch[static_cast<std::size_t>(k)] =
        image.at(corner.x + k % kSearchSize, corner.y + k / kSearchSize);
  }
  return patch;
}

std::vector<PatchCorner> all_corners(ImageView image) {
  std::vector<PatchCorner> corners;
  for (int y = 0; y + kSearchSize <= image.height_px; ++y) {
    for (int x = 0; x + kSearchSize <= image.width_px; ++x) corners.push_back({x, y});
  }
  return corners;
}

/// Textbook form in double precision.
double oracle(const SearchPatch& patch, ImageView image, PatchCorner corner) {
  const SearchPatch other = cut(image, corner);
  double mean_a = 0.0;
  double mean_b = 0.0;
  for (std::size_t k = 0; k < kSearchArea; ++k) {
    mean_a += patch[k] / static_cast<double>(kSearchArea);
    mean_b += other[k] / static_cast<double>(kSearchArea);
  }
  double ab = 0.0;
  double aa = 0.0;
  double bb = 0.0;
  for (std::size_t k = 0; k < kSearchArea; ++k) {
    ab += (patch[k] - mean_a) * (other[k] - mean_b);
    aa += (patch[k] - mean_a) * (patch[k] - mean_a);
    bb += (other[k] - mean_b) * (other[k] - mean_b);
  }
  return aa > 0.0 && bb > 0.0 ? ab / std::sqrt(aa * bb) : 0.0;
}

TEST(StereoKernel, CorrelationEqualsReferenceAndTextbook) {
  for (const auto& [low, high] : {std::pair(0, 255), std::pair(254, 255), std::pair(90, 110)}) {
    const PaddedImage image = random_image(low, high);
    const SearchPatch patch = cut(image.view(), {13, 21});
    const std::vector<PatchCorner> corners = all_corners(image.view());
    std::vector<float> fast(corners.size());
    std::vector<float> reference(corners.size());
    correlate(patch, image.view(), corners, fast);
    correlate_reference(patch, image.view(), corners, reference);
    EXPECT_EQ(fast, reference);
    for (std::size_t i = 0; i < corners.size(); i += 7) {
      EXPECT_NEAR(fast[i], oracle(patch, image.view(), corners[i]), 1e-5);
    }
  }
}

TEST(StereoKernel, CorrelationIgnoresGainAndBias) {
  const PaddedImage image = random_image(0, 100);
  SearchPatch patch = cut(image.view(), {30, 10});
  for (std::int16_t& value : patch) value = static_cast<std::int16_t>(2 * value + 40);
  const std::vector<PatchCorner> corners = {{30, 10}, {31, 10}};
  std::vector<float> correlations(2);
  correlate(patch, image.view(), corners, correlations);
  EXPECT_NEAR(correlations[0], 1.0f, 1e-6f);
  EXPECT_LT(correlations[1], 0.6f);
}

TEST(StereoKernel, FlatPatchHasNoCorrelation) {
  const PaddedImage flat = random_image(7, 7);
  const PaddedImage textured = random_image(0, 255);
  const std::vector<PatchCorner> corners = {{0, 0}};
  std::vector<float> correlations(1);
  correlate(cut(textured.view(), {3, 3}), flat.view(), corners, correlations);
  EXPECT_EQ(correlations[0], 0.0f);
  correlate(cut(flat.view(), {3, 3}), textured.view(), corners, correlations);
  EXPECT_EQ(correlations[0], 0.0f);
}

TEST(StereoKernel, PatchSumsEqualReferenceBitForBit) {
  const PaddedImage image = random_image(0, 255);
  Rng rng(3, 4);
  AlignPatch patch;
  for (int k = 0; k < kAlignArea; ++k) {
    const auto i = static_cast<std::size_t>(k);
    patch.value[i] = static_cast<float>(rng.uniform(-100.0, 100.0));
    patch.along[i] = static_cast<float>(rng.uniform(-30.0, 30.0));
    patch.across[i] = static_cast<float>(rng.uniform(-30.0, 30.0));
  }
  for (int trial = 0; trial < 200; ++trial) {
    // The last column and row that interpolation reads are the image's last.
    const PatchCorner corner{static_cast<int>(rng.below(80 - kAlignSize)),
                             static_cast<int>(rng.below(60 - kAlignSize))};
    const float x = trial == 0 ? 0.0f : static_cast<float>(rng.uniform());
    const float y = trial == 0 ? 0.0f : static_cast<float>(rng.uniform());
    EXPECT_EQ(sum_patch(patch, image.view(), corner, x, y),
              sum_patch_reference(patch, image.view(), corner, x, y));
  }
}

}  // namespace
}  // namespace waymark

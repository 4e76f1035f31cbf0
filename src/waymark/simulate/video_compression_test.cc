// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/video_compression.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/simulate/named_cameras.h"
#include "waymark/simulate/sequence.h"

namespace waymark {
namespace {

constexpr double kImagesPerSecond = 20.0;

/// What a camera sees in a second and a half.
std::vector<Image> walk(int height_px) {
  SequenceSpec spec;
  spec.chain = mono_chain(named_camera("perspective", height_px));
  spec.rate_hz = kImagesPerSecond;
  spec.num_frames = 30;
  SimulatedSequence sequence(spec);
  std::vector<Image> images;
  for (int i = 0; i < spec.num_frames; ++i) images.push_back(sequence.frame(i).images[0]);
  return images;
}

std::vector<Image> compressed(const std::vector<Image>& images, double kbit_per_s) {
  VideoCompression compression(kbit_per_s, kImagesPerSecond);
  std::vector<Image> results;
  for (const Image& image : images) results.push_back(compression.compress(image));
  return results;
}

/// Root mean square of the grey values, from the second half on.
double difference(const std::vector<Image>& a, const std::vector<Image>& b) {
  double squares = 0.0;
  std::size_t count = 0;
  for (std::size_t k = a.size() / 2; k < a.size(); ++k) {
    for (std::size_t i = 0; i < a[k].values.size(); ++i, ++count) {
      squares += std::pow(static_cast<double>(a[k].values[i]) - b[k].values[i], 2);
    }
  }
  return std::sqrt(squares / static_cast<double>(count));
}

TEST(VideoCompression, TakesMoreAwayAtLowerBitRates) {
  const std::vector<Image> images = walk(240);
  const double poor = difference(images, compressed(images, 200.0));
  const double fair = difference(images, compressed(images, 800.0));
  const double good = difference(images, compressed(images, 20000.0));
  EXPECT_GT(poor, 1.5 * fair);
  EXPECT_GT(fair, 1.5 * good);
  EXPECT_LT(good,
            2.0);  // Brightness is as it was, and every image comes with its own.
}

TEST(VideoCompression, GivesTheSameBitsAgain) {
  const std::vector<Image> images = walk(120);
  const std::vector<Image> first = compressed(images, 100.0);
  const std::vector<Image> second = compressed(images, 100.0);
  for (std::size_t i = 0; i < images.size(); ++i) EXPECT_EQ(first[i].values, second[i].values);
}

TEST(VideoCompression, TakesOddSizes) {
  Image image(161, 121);
  for (int y = 0; y < 121; ++y) {
    for (int x = 0; x < 161; ++x) image.row(y)[x] = static_cast<std::uint8_t>(x + y / 2);
  }
  const Image result = compressed({image}, 5000.0)[0];
  ASSERT_EQ(result.width_px, 161);
  ASSERT_EQ(result.height_px, 121);
  EXPECT_LT(difference({image}, {result}), 3.0);
}

}  // namespace
}  // namespace waymark

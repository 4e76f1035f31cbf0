// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/levels.h"

#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "waymark/base/testing/temporary_folder.h"
#include "waymark/input/input.h"

namespace waymark {
namespace {

using testing::TemporaryFolder;

/// Numbers from low to high, as many of each.
Levels levels_between(int low, int high) {
  BasicImage<std::uint16_t> image(100, 100);
  for (std::size_t i = 0; i < image.values.size(); ++i) {
    image.values[i] = static_cast<std::uint16_t>(
        low + static_cast<int>(i) * (high - low) / static_cast<int>(image.values.size() - 1));
  }
  GreyRangeEstimator meter;
  meter.add(image);
  return meter.levels();
}

TEST(Levels, AreThoseOf16BitsWhereMuchOfThemIsUsed) {
  EXPECT_EQ(GreyRangeEstimator().levels(), Levels{});
  EXPECT_EQ(levels_between(0, 65535), Levels{});
  EXPECT_EQ(levels_between(1000, 20000), Levels{});
  EXPECT_EQ(Levels{}.describe(), "");
}

TEST(Levels, AreWhatIsSpannedWhereThatIsLittle) {
  const Levels twelve_bits = levels_between(0, 4095);
  EXPECT_EQ(twelve_bits.black, 0.0);
  EXPECT_NEAR(twelve_bits.white, 4095 * 1.05, 20.0);
  const Levels thermal = levels_between(7000, 8200);
  EXPECT_NEAR(thermal.black, 6940, 5.0);
  EXPECT_NEAR(thermal.white, 8260, 5.0);
  const Levels dark = levels_between(50, 60);
  EXPECT_NEAR(dark.white - dark.black, 256.0, 100.0) << "noise does not become the picture";
}

TEST(Levels, PassOverAFewPixelsThatAreDead) {
  BasicImage<std::uint16_t> image(100, 100);
  for (std::size_t i = 0; i < image.values.size(); ++i)
    image.values[i] = static_cast<std::uint16_t>(7000 + i % 1000);
  image.values[17] = 65535;
  image.values[18] = 0;
  GreyRangeEstimator meter;
  meter.add(image);
  EXPECT_NEAR(meter.levels().white, 8050, 10.0);
}

/// The brightest image is the last one: one scale for all, whatever part is used.
TEST(Levels, AreTheSameForAllImagesOfARecording) {
  const TemporaryFolder folder;
  for (int i = 1; i <= 4; ++i) {
    cv::Mat image(48, 64, CV_16UC1);
    for (int x = 0; x < image.cols; ++x) image.col(x) = 10 * i * (x + 1);
    cv::imwrite((folder / (std::to_string(i) + ".png")).string(), image);
  }
  const auto grey_at_32 = [&](const InputOptions& options, int skipped) {
    const std::unique_ptr<Input> input = open_input(folder.path(), options);
    for (int i = 0; i < skipped; ++i) input->next();
    return static_cast<int>(input->next()->images.at(0).view().at(31, 5));
  };
  const int third = grey_at_32({}, 2);
  EXPECT_NEAR(third, 255.0 * 960 / 2680, 3);
  EXPECT_NEAR(grey_at_32({}, 0), third / 3, 1);
  EXPECT_EQ(grey_at_32({.first = 2}, 0), third);
  EXPECT_THAT(open_input(folder.path(), {})->info().lines,
              ::testing::Contains(::testing::StartsWith("16-bit images: 0 is black, 2")));
}

}  // namespace
}  // namespace waymark

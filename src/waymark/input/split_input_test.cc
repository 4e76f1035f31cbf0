// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/split_input.h"

#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/input/decode.h"

namespace waymark {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using testing::input_error_of;
using testing::TemporaryFolder;

/// Blurred noise; another seed is another place.
cv::Mat scene(int seed) {
  cv::Mat image(120, 200, CV_8UC1);
  cv::RNG random(static_cast<std::uint64_t>(seed));
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(image, image, {0, 0}, 2.0);
  cv::normalize(image, image, 0, 255, cv::NORM_MINMAX);
  return image;
}

/// Two views of 160x120 px.
cv::Mat picture(bool is_pair, bool is_beside) {
  const cv::Mat left = scene(1)(cv::Rect(20, 0, 160, 120));
  const cv::Mat right =
      is_pair ? scene(1)(cv::Rect(28, 0, 160, 120)) : scene(2)(cv::Rect(0, 0, 160, 120));
  cv::Mat whole;
  if (is_beside) {
    cv::hconcat(left, right, whole);
  } else {
    cv::vconcat(left, right, whole);
  }
  return whole;
}

Image as_image(const cv::Mat& mat) {
  Image image(mat.cols, mat.rows);
  std::copy(mat.begin<std::uint8_t>(), mat.end<std::uint8_t>(), image.values.begin());
  return image;
}

CameraChain calibration(std::size_t num_cameras) {
  CameraChain chain;
  chain.cameras.resize(num_cameras);
  for (ChainCamera& camera : chain.cameras) {
    camera.description.width_px = 160;
    camera.description.height_px = 120;
  }
  return chain;
}

TEST(Split, IsToldByTheSizeOfTheCamera) {
  EXPECT_EQ(split_by_size({320, 120}, {160, 120}), Split::kSideBySide);
  EXPECT_EQ(split_by_size({160, 240}, {160, 120}), Split::kTopBottom);
  EXPECT_EQ(split_by_size({320, 240}, {160, 120}), std::nullopt);
}

TEST(Split, IsToldByWhatTheHalvesShow) {
  EXPECT_EQ(split_by_content(as_image(picture(true, true))), Split::kSideBySide);
  EXPECT_EQ(split_by_content(as_image(picture(false, true))), std::nullopt);
  // Their views differ along the picture, as of cameras one above the other.
  cv::Mat turned;
  cv::rotate(picture(true, true), turned, cv::ROTATE_90_CLOCKWISE);
  EXPECT_EQ(split_by_content(as_image(turned)), Split::kTopBottom);
  EXPECT_EQ(split_by_content(Image(320, 120)), std::nullopt) << "nothing to see";
}

class SplitInputTest : public ::testing::Test {
 protected:
  void write(const cv::Mat& image) {
    for (const char* name : {"1.png", "2.png", "3.png", "4.png"})
      cv::imwrite((folder_ / name).string(), image);
  }

  TemporaryFolder folder_;
};

TEST_F(SplitInputTest, IsAPairWithACalibrationOfTwoHalves) {
  write(picture(true, true));
  const auto input = open_input(
      folder_.path(), {.has_jpeg = true, .has_right_jpeg = true, .calibration = calibration(2)});
  EXPECT_EQ(input->info().setup, Setup::kStereo);
  EXPECT_EQ(input->info().width_px, 160);
  EXPECT_THAT(input->info().lines,
              Contains(HasSubstr("side by side in each picture, taken as a pair")));
  const InputFrame frame = input->next().value();
  ASSERT_EQ(frame.images.size(), 2U);
  EXPECT_EQ(frame.images[0].view().at(48, 30), frame.images[1].view().at(40, 30));
  EXPECT_NEAR(decode_grey_image(frame.right_jpeg)->view().at(40, 30),
              frame.images[1].view().at(40, 30),
              12);
  const auto mono =
      open_input(folder_.path(), {.setup = Setup::kMono, .calibration = calibration(2)});
  EXPECT_EQ(mono->next()->images.size(), 1U);
  EXPECT_EQ(open_input(folder_.path(), {.calibration = calibration(1)})->info().setup,
            Setup::kMono);
}

TEST_F(SplitInputTest, TakesTheFirstHalfWithoutACalibration) {
  write(picture(true, true));
  const auto found = open_input(folder_.path(), {});
  EXPECT_EQ(found->info().width_px, 160);
  EXPECT_EQ(found->next()->images.size(), 1U);
  EXPECT_EQ(open_input(folder_.path(), {.split = Split::kNone})->info().width_px, 320);
  EXPECT_EQ(open_input(folder_.path(), {.split = Split::kTopBottom})->next()->images.size(), 2U);
  write(picture(false, true));
  EXPECT_EQ(open_input(folder_.path(), {})->info().width_px, 320);
}

TEST_F(SplitInputTest, SaysWhatDoesNotFit) {
  write(picture(true, false));
  InputOptions options{.calibration = calibration(2)};
  options.calibration->cameras[0].description.width_px = 100;
  EXPECT_THAT(input_error_of([&] { open_input(folder_.path(), options); }),
              HasSubstr("is 160x240 px, expected 100x120 px"));
  options.split = Split::kTopBottom;
  EXPECT_THAT(input_error_of([&] { open_input(folder_.path(), options); }),
              HasSubstr("--split: is 160x120 px, expected 100x120 px"));
}

}  // namespace
}  // namespace waymark

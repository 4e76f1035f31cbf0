// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/resized_input.h"

#include <gmock/gmock.h>

#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/input/decode.h"
#include "waymark/input/testing/images.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using testing::input_error_of;
using testing::TemporaryFolder;
using testing::write_image;

class ResizedInputTest : public ::testing::Test {
 protected:
  ResizedInputTest() {
    write_image(folder_ / "rgb" / "1.png", 64, 48, 100);
    write_image(folder_ / "mask.png", 64, 48, 255);
    CameraDescription camera;
    camera.camera_model = "pinhole";
    camera.intrinsics = {50.0, 52.0, 31.5, 23.5};
    camera.width_px = 64;
    camera.height_px = 48;
    options_.calibration.emplace().cameras.push_back({camera, Rigid3()});
    options_.mask = folder_ / "mask.png";
    options_.has_jpeg = true;
  }

  TemporaryFolder folder_;
  InputOptions options_;
};

TEST_F(ResizedInputTest, TakesCalibrationMasksAndJpegsAlong) {
  for (const int width_px : {32, 47, 63}) {
    options_.resize_px = width_px;
    const auto input = open_input(folder_ / "rgb", options_);
    EXPECT_EQ(input->info().width_px, width_px);
    const InputFrame frame = input->next().value();
    ASSERT_EQ(frame.images.size(), 1u);
    EXPECT_EQ(frame.images[0].width_px, width_px);
    EXPECT_EQ(frame.images[0].height_px, 48 * width_px / 64);
    EXPECT_EQ(frame.images[0].view().at(8, 6), 100);
    EXPECT_EQ(frame.mask->width_px, width_px);
    EXPECT_EQ(decode_color_image(frame.jpeg)->width_px, width_px);
    const CameraDescription& camera = input->info().calibration->cameras[0].description;
    EXPECT_EQ(camera.width_px, width_px);
    EXPECT_EQ(camera.height_px, frame.images[0].height_px);
    EXPECT_NEAR(camera.intrinsics[0], 50.0 * width_px / 64, 1e-5);
    EXPECT_NEAR(camera.intrinsics[2], 0.5 * width_px - 0.5, 1e-5);
    EXPECT_FALSE(input->next());
    const CameraChain unchanged = input->of_unchanged_images(*input->info().calibration);
    EXPECT_EQ(unchanged.cameras[0].description.width_px, 64);
    EXPECT_EQ(unchanged.cameras[0].description.height_px, 48);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(unchanged.cameras[0].description.intrinsics[i],
                  options_.calibration->cameras[0].description.intrinsics[i],
                  1e-9);
    }
  }
}

TEST_F(ResizedInputTest, OnlyMakesSmaller) {
  options_.resize_px = 64;
  EXPECT_EQ(input_error_of([&] { open_input(folder_ / "rgb", options_); }),
            "--resize: is 64, expected less than the 64 px that images are wide");
}

TEST_F(ResizedInputTest, RefusesModelsThatItDoesNotKnow) {
  options_.resize_px = 32;
  options_.calibration->cameras[0].description.camera_model = "mine";
  EXPECT_THAT(input_error_of([&] { open_input(folder_ / "rgb", options_); }),
              HasSubstr("--resize: does not know what the numbers of model 'mine' mean"));
}

TEST_F(ResizedInputTest, SmallImagesAreEnlarged) {
  EXPECT_EQ(enlargement_for({319, 239}), 2);
  EXPECT_EQ(enlargement_for({160, 120}), 3);
  EXPECT_EQ(enlargement_for({120, 160}), 3);
  EXPECT_EQ(enlargement_for({64, 48}), 4);
  EXPECT_EQ(enlargement_for({320, 180}), 1);
  EXPECT_EQ(enlargement_for({240, 240}), 1);
  EXPECT_EQ(enlargement_for({8, 40}), 1) << "which no camera takes";

  EXPECT_EQ(open_input(folder_ / "rgb", options_)->info().width_px, 64);
  options_.enlarges_small = true;
  const auto input = open_input(folder_ / "rgb", options_);
  EXPECT_EQ(input->info().enlargement, 4);
  EXPECT_EQ(input->info().width_px, 256);
  EXPECT_THAT(input->info().lines, ::testing::Contains("small images, enlarged to 256x192 px"));
  const InputFrame frame = input->next().value();
  EXPECT_EQ(size_of(frame.images.at(0)), (ImageSize{256, 192}));
  EXPECT_EQ(frame.images[0].view().at(100, 90), 100);
  EXPECT_EQ(size_of(*frame.mask), (ImageSize{256, 192}));
  EXPECT_EQ(decode_color_image(frame.jpeg)->width_px, 256);
  const CameraDescription& camera = input->info().calibration->cameras[0].description;
  EXPECT_EQ(camera.width_px, 256);
  EXPECT_DOUBLE_EQ(camera.intrinsics[0], 200.0);
  EXPECT_DOUBLE_EQ(camera.intrinsics[2], 127.5);
}

TEST_F(ResizedInputTest, TakesTheCalibrationOfImagesThatAreEnlarged) {
  options_.enlarges_small = true;
  options_.calibration = open_input(folder_ / "rgb", options_)->info().calibration;
  const auto input = open_input(folder_ / "rgb", options_);
  const CameraDescription& camera = input->info().calibration->cameras[0].description;
  EXPECT_EQ(camera.width_px, 256);
  EXPECT_DOUBLE_EQ(camera.intrinsics[3], 95.5);
  options_.calibration->cameras[0].description.width_px = 128;
  EXPECT_THAT(input_error_of([&] { open_input(folder_ / "rgb", options_); }),
              HasSubstr("is 64x48 px, expected 128x192 px"));
}

TEST_F(ResizedInputTest, EnlargesNoModelThatItDoesNotKnow) {
  options_.enlarges_small = true;
  options_.calibration->cameras[0].description.camera_model = "mine";
  EXPECT_EQ(open_input(folder_ / "rgb", options_)->info().width_px, 64);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/rotated_input.h"

#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/input/decode.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using testing::input_error_of;
using testing::TemporaryFolder;

/// One image of 64x48 px, dark but for a light corner at its top right.
void write_corner(const std::filesystem::path& path, int type, double light) {
  std::filesystem::create_directories(path.parent_path());
  cv::Mat image(48, 64, type, cv::Scalar::all(0.1 * light));
  image(cv::Rect(48, 0, 16, 16)).setTo(cv::Scalar::all(light));
  cv::imwrite(path.string(), image);
}

InputOptions options_for(const TemporaryFolder& folder, int rotate_deg) {
  InputOptions options;
  options.rotate_deg = rotate_deg;
  options.depth = folder / "depth";
  options.mask = folder / "mask.png";
  options.has_jpeg = true;
  CameraDescription camera;
  camera.camera_model = "pinhole";
  camera.intrinsics = {50.0, 52.0, 30.0, 20.0};
  camera.width_px = 64;
  camera.height_px = 48;
  options.calibration.emplace().cameras.push_back({camera, Rigid3()});
  return options;
}

TEST(RotatedInput, TurnsAllThatBelongsTogether) {
  const TemporaryFolder folder;
  write_corner(folder / "rgb" / "1.png", CV_8UC1, 250);
  write_corner(folder / "depth" / "1.png", CV_16UC1, 5000);
  write_corner(folder / "mask.png", CV_8UC1, 255);
  // Where the corner at the top right goes.
  const std::vector<std::tuple<int, int, int>> corners = {{90, 44, 60}, {180, 3, 44}, {270, 3, 3}};
  for (const auto& [degrees, u, v] : corners) {
    SCOPED_TRACE(degrees);
    const auto input = open_input(folder / "rgb", options_for(folder, degrees));
    const bool is_upright = degrees != 180;
    EXPECT_EQ(input->info().width_px, is_upright ? 48 : 64);
    EXPECT_EQ(input->info().height_px, is_upright ? 64 : 48);
    EXPECT_EQ(input->info().calibration->cameras[0].description.width_px, is_upright ? 48 : 64);
    const InputFrame frame = input->next().value();
    EXPECT_EQ(frame.images.at(0).view().at(u, v), 250);
    EXPECT_EQ(frame.depth->view().at(u, v), 5000);
    EXPECT_EQ(frame.mask->view().at(u, v), 255);
    EXPECT_NE(frame.images.at(0).view().at(24, 24), 250);
    EXPECT_EQ(decode_color_image(frame.jpeg)->width_px, is_upright ? 48 : 64);
    const CameraChain unchanged = input->of_unchanged_images(*input->info().calibration);
    EXPECT_TRUE(unchanged.cameras[0].description.is_same(
        options_for(folder, degrees).calibration->cameras[0].description));
  }
}

TEST(RotatedInput, ResizesAfterwards) {
  const TemporaryFolder folder;
  write_corner(folder / "rgb" / "1.png", CV_8UC1, 250);
  InputOptions options;
  options.rotate_deg = 90;
  options.resize_px = 24;
  const auto input = open_input(folder / "rgb", options);
  EXPECT_EQ(input->next()->images.at(0).width_px, 24);
  EXPECT_EQ(input->info().height_px, 32);
  CameraDescription found;
  found.camera_model = "pinhole";
  found.intrinsics = {20.0, 21.0, 11.0, 14.0};
  found.width_px = 24;
  found.height_px = 32;
  const CameraChain unchanged = input->of_unchanged_images({{{found, Rigid3()}}, {}, {}});
  const CameraDescription& camera = unchanged.cameras[0].description;
  EXPECT_EQ(camera.width_px, 64);
  EXPECT_EQ(camera.height_px, 48);
  // Twice as large, then turned back by a quarter: (u, v) comes from (v, 47 - u).
  EXPECT_NEAR(camera.intrinsics[0], 42.0, 1e-3);
  EXPECT_NEAR(camera.intrinsics[1], 40.0, 1e-3);
  EXPECT_NEAR(camera.intrinsics[2], 2.0 * 14.5 - 0.5, 1e-3);
  EXPECT_NEAR(camera.intrinsics[3], 47.0 - (2.0 * 11.5 - 0.5), 1e-3);
}

TEST(RotatedInput, SaysWhatItCannotTurn) {
  const TemporaryFolder folder;
  write_corner(folder / "rgb" / "1.png", CV_8UC1, 250);
  InputOptions options;
  options.rotate_deg = 45;
  EXPECT_THAT(input_error_of([&] { open_input(folder / "rgb", options); }),
              HasSubstr("--rotate: is 45, expected 90, 180 or 270"));
  options.rotate_deg = 90;
  CameraDescription camera;
  camera.camera_model = "equirectangular";
  camera.width_px = 64;
  camera.height_px = 48;
  options.calibration.emplace().cameras.push_back({camera, Rigid3()});
  EXPECT_THAT(input_error_of([&] { open_input(folder / "rgb", options); }),
              HasSubstr("cannot turn a camera of model 'equirectangular' by 90 degrees"));
}

}  // namespace
}  // namespace waymark

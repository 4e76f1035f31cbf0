// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Recognition, folders of images, videos, masks and the choice of frames.
#include "waymark/input/input.h"

#include <gmock/gmock.h>

#include <fstream>
#include <opencv2/videoio.hpp>

#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/base/text.h"
#include "waymark/input/decode.h"
#include "waymark/input/testing/images.h"
#include "waymark/input/testing/videos.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error_of;
using testing::make_video;
using testing::TemporaryFolder;
using testing::truncate_file;
using testing::write_image;

/// Images named 1.png ... whose value is their number.
void make_images(const std::filesystem::path& folder, int num_images) {
  for (int i = 1; i <= num_images; ++i)
    write_image(folder / (std::to_string(i) + ".png"), 16, 12, i);
}

std::vector<int> values_of(Input& input) {
  std::vector<int> values;
  while (const std::optional<InputFrame> frame = input.next()) {
    values.push_back(frame->images.empty() ? -1 : frame->images[0].view().at(8, 6));
  }
  return values;
}

TEST(OpenInput, SaysWhatItWants) {
  const TemporaryFolder folder;
  const auto error = [](const std::filesystem::path& path, InputOptions options = {}) {
    return input_error_of([&] { open_input(path, options); });
  };
  EXPECT_THAT(error(folder / "none"), HasSubstr("none: does not exist, expected"));
  EXPECT_THAT(error(folder.path()), HasSubstr("holds no image, expected"));
  EXPECT_THAT(error(folder.write("a.txt", "x")), HasSubstr("a.txt: is neither folder nor video"));
  EXPECT_THAT(error("camera:97"), HasSubstr("camera:97: cannot be opened as a camera"));
  EXPECT_THAT(error("/dev/video97"), HasSubstr("cannot be opened as a camera"));
  EXPECT_THAT(error("camera:front"), HasSubstr("is no camera, expected camera:N"));
  InputOptions options;
  options.format = "eurok";
  EXPECT_EQ(error(folder.path(), options),
            "--format: is 'eurok', expected euroc, kitti, tum, replica, images, video or bag");
  options.format = "kitti";
  EXPECT_THAT(error(folder / "a.txt", options),
              HasSubstr("is a file, expected a folder for format kitti"));
  EXPECT_THAT(error(folder.path(), options),
              HasSubstr("image_0: missing or unreadable, expected a folder"));
}

TEST(ImageFolder, SortsByNumberAndAssumesARate) {
  const TemporaryFolder folder;
  make_images(folder.path(), 11);
  folder.write("notes.md", "not an image");
  const std::unique_ptr<Input> input = open_input(folder.path(), {});
  EXPECT_EQ(input->info().format, "images");
  EXPECT_EQ(input->info().num_frames, std::size_t{11});
  EXPECT_THAT(input->info().lines, ::testing::Contains(HasSubstr("30 images per second assumed")));
  EXPECT_EQ(input->next()->timestamp_ns, 0);
  EXPECT_EQ(input->next()->timestamp_ns, 33333333);
  EXPECT_THAT(values_of(*input), ElementsAre(3, 4, 5, 6, 7, 8, 9, 10, 11));
}

TEST(ImageFolder, FindsTimesInsideOrBeside) {
  const TemporaryFolder folder;
  make_images(folder / "images", 2);
  folder.write("times.txt", "1.5\n2.5\n");
  EXPECT_EQ(open_input(folder.path(), {})->next()->timestamp_ns, 1'500'000'000);
  EXPECT_EQ(open_input(folder / "images", {})->next()->timestamp_ns, 1'500'000'000);
  folder.write("images/times.txt", "3.5\n4.5\n");
  EXPECT_EQ(open_input(folder / "images", {})->next()->timestamp_ns, 3'500'000'000);
  folder.write("images/times.txt", "3.5\n");
  EXPECT_THAT(input_error_of([&] { open_input(folder.path(), {}); }),
              HasSubstr("images/times.txt: 1 times, expected 2"));
  folder.write("images/times.txt", "3.5 x\n");
  EXPECT_THAT(input_error_of([&] { open_input(folder.path(), {}); }),
              HasSubstr("images/times.txt:1: 2 fields, expected 1"));
}

TEST(ImageFolder, UsesTheFramesAskedFor) {
  const TemporaryFolder folder;
  make_images(folder.path(), 10);
  InputOptions options;
  options.first = 2;
  options.every = 3;
  std::unique_ptr<Input> input = open_input(folder.path(), options);
  EXPECT_EQ(input->info().num_frames, std::size_t{3});
  EXPECT_EQ(input->next()->index, 2u);
  EXPECT_EQ(input->next()->index, 5u);
  EXPECT_THAT(values_of(*input), ElementsAre(9));
  options.frames = 2;
  EXPECT_THAT(values_of(*open_input(folder.path(), options)), ElementsAre(3, 6));
  options.first = 10;
  EXPECT_THAT(input_error_of([&] { open_input(folder.path(), options); }),
              HasSubstr("--first: 10 is beyond the 10 frames"));
  options.first = SIZE_MAX;
  EXPECT_THROW(open_input(folder.path(), options), InputError);
  options = {};
  options.every = 0;
  EXPECT_THROW(open_input(folder.path(), options), InputError);
}

TEST(ImageFolder, SkipsBadImages) {
  const TemporaryFolder folder;
  make_images(folder.path(), 5);
  folder.write("1.png", "");  // The first image of all may be bad too.
  folder.write("3.png", "\x89PNG\r\n\x1A\n garbage");
  write_image(folder / "4.png", 12, 16, 4);
  const std::unique_ptr<Input> input = open_input(folder.path(), {});
  EXPECT_THAT(values_of(*input), ElementsAre(-1, 2, -1, -1, 5));
}

TEST(ImageFolder, GivesColourImagesAsJpegWhereAsked) {
  const TemporaryFolder folder;
  write_image(folder / "0.png", 64, 48, 90, CV_8UC3);
  cv::imwrite((folder / "1.jpg").string(), cv::Mat(48, 64, CV_8UC3, cv::Scalar(10, 60, 200)));
  InputOptions options;
  EXPECT_EQ(open_input(folder.path(), options)->next()->jpeg, "");
  options.has_jpeg = true;
  const std::unique_ptr<Input> input = open_input(folder.path(), options);
  const std::string first = input->next()->jpeg;
  EXPECT_EQ(first.substr(0, 2), "\xFF\xD8");
  EXPECT_NEAR(decode_color_image(first)->row(3)[5][1], 90, 2);
  EXPECT_EQ(input->next()->jpeg, read_text_file(folder / "1.jpg", "a JPEG file"));
}

TEST(ReadGreyImage, ConvertsWhatCamerasGive) {
  const TemporaryFolder folder;
  write_image(folder / "deep.png", 16, 12, 257 * 100, CV_16UC1);
  EXPECT_EQ(read_grey_image(folder / "deep.png")->view().at(3, 4), 100);
  write_image(folder / "colour.png", 16, 12, 77, CV_8UC3);
  EXPECT_EQ(read_grey_image(folder / "colour.png")->view().at(3, 4), 77);
  write_image(folder / "alpha.png", 16, 12, 77, CV_8UC4);
  EXPECT_EQ(read_grey_image(folder / "alpha.png")->view().at(3, 4), 77);
  cv::imwrite((folder / "red.png").string(), cv::Mat(12, 16, CV_8UC3, cv::Scalar(0, 0, 255)));
  EXPECT_NEAR(read_grey_image(folder / "red.png")->view().at(3, 4), 0.299 * 255, 1.0);
  EXPECT_EQ(read_depth_image(folder / "deep.png")->view().at(15, 11), 25700);
  EXPECT_FALSE(read_depth_image(folder / "colour.png"));
}

TEST(ReadGreyImage, RefusesDamagedFiles) {
  const TemporaryFolder folder;
  for (const char* name : {"a.png", "a.jpg"}) {
    for (double part : {0.1, 0.5, 0.9, 0.99}) {
      cv::Mat noise(120, 160, CV_8UC1);
      cv::theRNG().state = 1;
      cv::randu(noise, 0, 255);
      cv::imwrite((folder / name).string(), noise);
      truncate_file(folder / name, part);
      EXPECT_FALSE(read_grey_image(folder / name)) << name << " " << part;
    }
  }
  EXPECT_FALSE(read_grey_image(folder / "none.png"));
  EXPECT_FALSE(read_grey_image(folder.path()));
}

/// A bitmap of 0, as large as it says, of which the disk holds next to nothing.
void write_large_bitmap(const std::filesystem::path& path, int size_px) {
  const std::string size = std::to_string(size_px);
  std::ofstream(path) << "P4\n" << size << " " << size << "\n";
  const std::uintmax_t header_bytes = std::filesystem::file_size(path);
  const auto row_bytes = static_cast<std::uintmax_t>(size_px) / 8;
  std::filesystem::resize_file(path,
                               header_bytes + row_bytes * static_cast<std::uintmax_t>(size_px));
}

TEST(ReadGreyImage, RefusesHugeImagesByTheirHeaders) {
  const TemporaryFolder folder;
  make_images(folder / "images", 3);
  write_large_bitmap(folder / "images/2.png", 12000);
  EXPECT_FALSE(read_grey_image(folder / "images/2.png"));
  EXPECT_FALSE(read_depth_image(folder / "images/2.png"));
  EXPECT_FALSE(decode_color_image(read_text_file(folder / "images/2.png", "an image")));
  const std::unique_ptr<Input> input = open_input(folder.path(), {});
  input->next();
  const std::optional<InputFrame> frame = input->next();
  EXPECT_EQ(frame->fault, FrameFault::kUnreadable);
  EXPECT_EQ(frame->warning,
            (folder / "images/2.png").string() +
                ": is 12000x12000 px, expected at most 135 megapixels and 65500 px a side");
  InputOptions options;
  options.mask = folder / "images/2.png";
  EXPECT_THAT(
      input_error_of([&] { open_input(folder.path(), options); }),
      HasSubstr("2.png: is 12000x12000 px, expected at most 135 megapixels and 65500 px a side"));
}

TEST(ReadGreyImage, LeavesStandardErrorToTheProgram) {
  const TemporaryFolder folder;
  cv::Mat noise(120, 160, CV_8UC1);
  cv::randu(noise, 0, 255);
  cv::imwrite((folder / "a.png").string(), noise);
  const std::string whole = read_text_file(folder / "a.png", "an image");
  ::testing::internal::CaptureStderr();
  for (const std::size_t at : {16, 24, 40, 60, 500, 5000}) {
    std::string flipped = whole;
    flipped[at] = static_cast<char>(flipped[at] ^ 1);
    folder.write("b.png", flipped);
    EXPECT_FALSE(read_grey_image(folder / "b.png")) << at;
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(Mask, OneForAllFrames) {
  const TemporaryFolder folder;
  make_images(folder / "images", 2);
  write_image(folder / "mask.png", 16, 12, 255);
  InputOptions options;
  options.mask = folder / "mask.png";
  const std::unique_ptr<Input> input = open_input(folder.path(), options);
  EXPECT_EQ(input->next()->mask->view().at(0, 0), 255);
  EXPECT_TRUE(input->next()->mask);
  write_image(folder / "mask.png", 16, 13, 255);
  EXPECT_THAT(input_error_of([&] { open_input(folder.path(), options); }),
              HasSubstr("mask.png: not the size of the image"));
  options.mask = folder / "none.png";
  EXPECT_THAT(input_error_of([&] { open_input(folder.path(), options); }),
              HasSubstr("none.png: missing, expected a mask image"));
}

TEST(Mask, OnePerFrameByName) {
  const TemporaryFolder folder;
  make_images(folder / "images", 4);
  make_images(folder / "masks", 1);
  write_image(folder / "masks/3.jpg", 16, 12, 255);
  folder.write("masks/4.png", "bad");
  InputOptions options;
  options.mask = folder / "masks";
  const std::unique_ptr<Input> input = open_input(folder.path(), options);
  EXPECT_EQ(input->next()->mask->view().at(0, 0), 1);
  EXPECT_FALSE(input->next()->mask);
  EXPECT_TRUE(input->next()->mask);
  EXPECT_EQ(input->next()->fault, FrameFault::kUnreadable);
  std::filesystem::rename(folder / "masks/1.png", folder / "masks/other.png");
  std::filesystem::remove(folder / "masks/3.jpg");
  std::filesystem::remove(folder / "masks/4.png");
  EXPECT_THAT(input_error_of([&] { open_input(folder.path(), options); }),
              HasSubstr("masks: no mask has the name of a frame"));
}

TEST(Mask, OnePerFrameInOrderWhereNamesDiffer) {
  const TemporaryFolder folder;
  make_images(folder / "images", 11);
  for (int i = 0; i < 11; ++i) {
    write_image(folder / ("masks/m" + std::to_string(100 + i) + ".png"), 16, 12, 10 * i);
  }
  InputOptions options;
  options.mask = folder / "masks";
  options.first = 2;
  const std::unique_ptr<Input> input = open_input(folder.path(), options);
  for (int i = 2; i < 11; ++i) EXPECT_EQ(input->next()->mask->view().at(0, 0), 10 * i);
}

TEST(Mask, OnePerFrameOfAVideo) {
  const TemporaryFolder folder;
  for (int i = 0; i < 10; ++i) {
    write_image(folder / ("images/" + std::to_string(i) + ".png"), 64, 48, 100);
  }
  make_video(folder / "masks.avi", 9);  // From the seventh on more light than dark.
  InputOptions options;
  options.mask = folder / "masks.avi";
  options.first = 4;
  options.every = 2;
  const std::unique_ptr<Input> input = open_input(folder / "images", options);
  EXPECT_EQ(input->next()->mask->view().at(30, 20), 0);
  EXPECT_EQ(input->next()->mask->view().at(30, 20), 255);
  EXPECT_EQ(input->next()->mask->view().at(30, 20), 255);
  EXPECT_FALSE(input->next());
  options.mask = folder.write("no.mp4", "x");
  EXPECT_THAT(input_error_of([&] { open_input(folder / "images", options); }),
              HasSubstr("no.mp4: cannot be opened as a video"));
}

}  // namespace
}  // namespace waymark

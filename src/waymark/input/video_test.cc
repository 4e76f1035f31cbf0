// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Videos, alone and in pairs.
#include <gmock/gmock.h>

#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/base/text.h"
#include "waymark/input/decode.h"
#include "waymark/input/input.h"
#include "waymark/input/testing/videos.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using testing::input_error_of;
using testing::make_video;
using testing::TemporaryFolder;

TEST(Video, GivesFramesWithTheTimesOfTheContainer) {
  const TemporaryFolder folder;
  make_video(folder / "v.avi", 6);
  const std::unique_ptr<Input> input = open_input(folder.path(), {});
  EXPECT_EQ(input->info().format, "video");
  EXPECT_EQ(input->info().num_frames, std::size_t{6});
  EXPECT_EQ(input->info().width_px, 64);
  for (int i = 0; i < 6; ++i) {
    const std::optional<InputFrame> frame = input->next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->index, static_cast<std::size_t>(i));
    EXPECT_EQ(frame->timestamp_ns, i * 100'000'000);
    EXPECT_NEAR(frame->images.at(0).view().at(8, 6), 20 * (i + 1), 3);
  }
  EXPECT_FALSE(input->next());
}

TEST(Video, GivesFramesAsJpegWhereAsked) {
  const TemporaryFolder folder;
  make_video(folder / "v.avi", 3);
  InputOptions options;
  options.has_jpeg = true;
  const std::unique_ptr<Input> input = open_input(folder / "v.avi", options);
  for (int i = 1; i <= 3; ++i) {
    const std::optional<InputFrame> frame = input->next();
    ASSERT_TRUE(frame);
    const std::optional<ColorImage> image = decode_color_image(frame->jpeg);
    ASSERT_TRUE(image);
    EXPECT_NEAR(image->row(3)[5][2], 20 * i, 3);
  }
}

TEST(Video, TakesTimesBesideItAndTheFramesAskedFor) {
  const TemporaryFolder folder;
  make_video(folder / "v.avi", 6);
  folder.write("times.txt", "1\n2\n3\n4\n5\n");
  InputOptions options;
  options.first = 1;
  options.every = 2;
  const std::unique_ptr<Input> input = open_input(folder / "v.avi", options);
  EXPECT_EQ(input->info().num_frames, std::size_t{2});
  EXPECT_THAT(input->info().lines, ::testing::Contains(HasSubstr("5 times for 6 frames")));
  std::optional<InputFrame> frame = input->next();
  EXPECT_EQ(frame->timestamp_ns, 2'000'000'000);
  EXPECT_NEAR(frame->images.at(0).view().at(8, 6), 40, 3);
  frame = input->next();
  EXPECT_EQ(frame->index, 3u);
  EXPECT_NEAR(frame->images.at(0).view().at(8, 6), 80, 3);
  EXPECT_FALSE(input->next());
}

TEST(Video, OfTwoCamerasIsStereo) {
  const TemporaryFolder folder;
  make_video(folder / "left.avi", 6);
  make_video(folder / "right.avi", 4);
  EXPECT_THAT(input_error_of([&] { open_input(folder.path(), {}); }),
              ::testing::AllOf(HasSubstr("for a stereo pair say waymark run"),
                               HasSubstr("left.avi"),
                               HasSubstr("right.avi")));
  const std::unique_ptr<Input> input =
      open_input(folder / "left.avi", {.right = folder / "right.avi"});
  EXPECT_EQ(input->info().setup, Setup::kStereo);
  for (int i = 0; i < 6; ++i) {
    const InputFrame frame = input->next().value();
    EXPECT_EQ(frame.fault, FrameFault::kNone);
    ASSERT_EQ(frame.images.size(), i < 4 ? 2U : 1U);
    for (const Image& image : frame.images) EXPECT_NEAR(image.view().at(8, 6), 20 * (i + 1), 3);
  }
  EXPECT_EQ(input->info().counts.without_partner, 2U);
  const auto mono =
      open_input(folder / "left.avi", {.setup = Setup::kMono, .right = folder / "right.avi"});
  EXPECT_EQ(mono->next()->images.size(), 1U);
  EXPECT_EQ(open_input(folder / "left.avi", {.first = 2, .fps = 4})->next()->timestamp_ns,
            500'000'000);
}

TEST(Video, GoesOnInTheNextFileOfOneRecording) {
  const TemporaryFolder folder;
  make_video(folder / "GX010042.avi", 6);
  make_video(folder / "GX020042.avi", 4);
  const std::unique_ptr<Input> input = open_input(folder.path(), {});
  EXPECT_EQ(input->info().num_frames, std::size_t{10});
  EXPECT_THAT(input->info().lines, ::testing::Contains(HasSubstr("goes on in")));
  for (int i = 0; i < 10; ++i) {
    const InputFrame frame = input->next().value();
    EXPECT_EQ(frame.timestamp_ns, i * 100'000'000);
    EXPECT_NEAR(frame.images.at(0).view().at(8, 6), 20 * (i % 6 + 1), 3);
  }
  EXPECT_FALSE(input->next());
  make_video(folder / "GX010043.avi", 4);
  EXPECT_THAT(input_error_of([&] { open_input(folder.path(), {}); }), HasSubstr("holds 3 videos"));
}

TEST(Video, IsRecognisedByContent) {
  const TemporaryFolder folder;
  make_video(folder / "v.avi", 3);
  std::filesystem::rename(folder / "v.avi", folder / "recording.001");
  EXPECT_EQ(open_input(folder / "recording.001", {})->info().format, "video");
  folder.write("list.001", "#EXTM3U\n#EXTINF:10,\nrecording.001\n#EXT-X-ENDLIST\n");
  EXPECT_THAT(input_error_of([&] { open_input(folder / "list.001", {}); }),
              HasSubstr("is neither folder nor video nor bag"));
}

TEST(Video, TellsThatARecordingWasNotClosed) {
  const TemporaryFolder folder;
  const std::string box(
      "\0\0\0\x10"
      "ftypisom\0\0\0\0",
      16);
  folder.write("v.mp4",
               box +
                   std::string("\0\x10\0\0"
                               "mdat",
                               8) +
                   std::string(5000, 'x'));
  EXPECT_THAT(input_error_of([&] { open_input(folder / "v.mp4", {}); }),
              HasSubstr("was not closed, as where the power failed: its index (moov) is missing"));
}

TEST(Video, LeavesOutTimesOutOfOrder) {
  const TemporaryFolder folder;
  make_video(folder / "v.avi", 11);
  folder.write("times.txt", "1\n2\n3\n3\n5\n6\n7\n8\n9\n10\n11\n");
  const std::unique_ptr<Input> input = open_input(folder / "v.avi", {.first = 3});
  EXPECT_EQ(input->info().counts.out_of_order, 1U);
  EXPECT_EQ(input->info().num_frames, 7U);
  const InputFrame frame = input->next().value();
  EXPECT_EQ(frame.timestamp_ns, 5'000'000'000);
  EXPECT_EQ(frame.index, 4U);
}

TEST(Video, TellsThatItEndsBeforeItsContainerSays) {
  const TemporaryFolder folder;
  make_video(folder / "v.avi", 12);
  std::string bytes = read_text_file(folder / "v.avi", "");
  // The number of frames in the header of the stream (AVI RIFF file reference, AVISTREAMHEADER).
  const std::size_t length = bytes.find("strh") + 40;
  ASSERT_EQ(bytes[length], 12);
  bytes[length] = 60;
  folder.write("v.avi", bytes);
  const std::unique_ptr<Input> input = open_input(folder / "v.avi", {});
  EXPECT_EQ(input->info().num_frames, std::size_t{60});
  std::size_t num_frames = 0;
  while (input->next()) ++num_frames;
  EXPECT_EQ(num_frames, 12u);
  EXPECT_EQ(input->info().counts.missing_at_end, 48u);
}

TEST(Video, GoesOnAfterWhatIsDamaged) {
  const TemporaryFolder folder;
  make_video(folder / "v.avi", 12);
  std::string bytes = read_text_file(folder / "v.avi", "");
  // Two frames in the middle.
  const std::size_t start = bytes.size() * 4 / 10;
  for (std::size_t i = start; i < start + bytes.size() / 8; ++i) {
    bytes[i] = static_cast<char>(i * 31);
  }
  folder.write("v.avi", bytes);
  const std::unique_ptr<Input> input = open_input(folder / "v.avi", {});
  float last = 0.0F;
  while (const auto frame = input->next()) {
    if (!frame->images.empty()) last = frame->images[0].view().at(8, 6);
  }
  EXPECT_NEAR(last, 240, 3) << "the last frame is read";
}

TEST(Video, SaysWhatIsWrong) {
  const TemporaryFolder folder;
  folder.write("a.mp4", "garbage");
  EXPECT_THAT(input_error_of([&] { open_input(folder / "a.mp4", {}); }),
              HasSubstr("a.mp4: cannot be opened as a video"));
  folder.write("b.mp4", "garbage");
  EXPECT_THAT(input_error_of([&] { open_input(folder.path(), {}); }),
              HasSubstr("holds 2 videos, a.mp4 and b.mp4, expected one: for example"));
  make_video(folder / "c.avi", 3);
  folder.write("times.txt", "\n");
  EXPECT_THAT(input_error_of([&] { open_input(folder / "c.avi", {}); }),
              HasSubstr("times.txt: empty"));
  folder.write("times.txt", "1\n2\n3\n4\n5\n6\n");
  InputOptions options;
  options.first = 5;
  EXPECT_THAT(input_error_of([&] { open_input(folder / "c.avi", options); }),
              HasSubstr("ends before the first frame"));
  options.first = 0;
  options.calibration = CameraChain{};
  options.calibration->cameras.resize(1);
  options.calibration->cameras[0].description.width_px = 640;
  options.calibration->cameras[0].description.height_px = 480;
  EXPECT_THAT(input_error_of([&] { open_input(folder / "c.avi", options); }),
              HasSubstr("is 64x48 px, expected 640x480 px"));
}

}  // namespace
}  // namespace waymark

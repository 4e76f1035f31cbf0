// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Images of two folders, and what is said of folders that hold others.
#include "waymark/input/pairing.h"

#include <gmock/gmock.h>

#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/input/input.h"
#include "waymark/input/reading.h"
#include "waymark/input/testing/images.h"

namespace waymark {
namespace {

using ::testing::Contains;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error_of;
using testing::TemporaryFolder;
using testing::write_image;

/// left/0.png ... and right/, of the values 10 + i and 20 + i.
void make_pair_folders(const TemporaryFolder& folder, int count) {
  for (int i = 0; i < count; ++i) {
    const std::string name = std::to_string(i) + ".png";
    write_image(folder / ("left/" + name), 8, 6, 10 + i);
    write_image(folder / ("right/" + name), 8, 6, 20 + i);
  }
}

std::string open_error(const std::filesystem::path& path, const InputOptions& options = {}) {
  return input_error_of([&] { open_input(path, options); });
}

TEST(TwoFolders, AreAStereoPair) {
  const TemporaryFolder folder;
  make_pair_folders(folder, 3);
  std::filesystem::remove(folder / "right/1.png");
  const auto input = open_input(folder / "left", {.right = folder / "right"});
  EXPECT_EQ(input->info().setup, Setup::kStereo);
  EXPECT_EQ(input->info().counts.without_partner, 1U);
  EXPECT_THAT(input->next()->images.at(1).values, Each(20));
  EXPECT_EQ(input->next()->images.size(), 1U);
  EXPECT_THAT(input->next()->images.at(1).values, Each(22));
  const auto mono = open_input(folder / "left", {.setup = Setup::kMono, .right = folder / "right"});
  EXPECT_EQ(mono->next()->images.size(), 1U);
  const auto later = open_input(folder / "left", {.first = 1, .right = folder / "right"});
  EXPECT_EQ(later->next()->fault, FrameFault::kUnreadable) << "no scale to begin with";
  EXPECT_EQ(later->next()->images.size(), 2U);
}

TEST(TwoFolders, PairByOrderWhereNoNameFits) {
  const TemporaryFolder folder;
  make_pair_folders(folder, 3);
  for (int i = 0; i < 3; ++i) {
    const std::string name = std::to_string(i) + ".png";
    std::filesystem::rename(folder / ("right/" + name), folder / ("right/r" + name));
  }
  const auto input = open_input(folder / "left", {.right = folder / "right"});
  input->next();
  EXPECT_THAT(input->next()->images.at(1).values, Each(21));
  std::filesystem::remove(folder / "right/r0.png");
  EXPECT_THAT(open_error(folder / "left", {.right = folder / "right"}),
              HasSubstr("2 images, none of the name of one of the 3 of"));
}

TEST(TwoFolders, LeaveOutWhatComesBeforeTheFirstPair) {
  const TemporaryFolder folder;
  make_pair_folders(folder, 3);
  std::filesystem::remove(folder / "right/0.png");
  const auto input = open_input(folder / "left", {.right = folder / "right", .fps = 10});
  EXPECT_EQ(input->info().num_frames, 2U);
  EXPECT_EQ(input->info().counts.without_partner, 0U);
  EXPECT_EQ(input->next()->timestamp_ns, 100'000'000);
}

TEST(TwoFolders, MayBeColourAndDepth) {
  const TemporaryFolder folder;
  write_image(folder / "rgb/a.png", 8, 6, 10);
  write_image(folder / "rgb/b.png", 8, 6, 11);
  write_image(folder / "depth/a.png", 8, 6, 500, CV_16UC1);
  EXPECT_THAT(open_error(folder.path()),
              HasSubstr("depth/ and rgb/ hold 1 and 2 images: for colour"));
  EXPECT_THAT(open_error(folder.path()), HasSubstr("rgb --depth " + (folder / "depth").string()));
  const auto input = open_input(folder / "rgb", {.depth = folder / "depth"});
  EXPECT_EQ(input->info().setup, Setup::kRgbd);
  EXPECT_THAT(input->next()->depth->values, Each(500));
  EXPECT_FALSE(input->next()->depth);
  EXPECT_EQ(input->info().counts.without_partner, 1U);
}

TEST(TwoFolders, MayHaveDepthOfFewerPixels) {
  const TemporaryFolder folder;
  write_image(folder / "rgb/a.png", 1296, 968, 10);
  cv::Mat depth(480, 640, CV_16UC1, cv::Scalar(500));
  depth(cv::Rect(320, 0, 320, 480)).setTo(900);
  std::filesystem::create_directories(folder / "depth");
  cv::imwrite((folder / "depth/a.png").string(), depth);
  const auto input = open_input(folder / "rgb", {.depth = folder / "depth"});
  EXPECT_THAT(input->info().lines, Contains("depth images of 640x480 px are enlarged"));
  const DepthImage enlarged = input->next()->depth.value();
  EXPECT_EQ(enlarged.width_px, 1296);
  EXPECT_EQ(enlarged.view().at(647, 967), 500);
  EXPECT_EQ(enlarged.view().at(648, 0), 900);
  write_image(folder / "depth/a.png", 640, 400, 500, CV_16UC1);
  EXPECT_THAT(open_error(folder / "rgb", {.depth = folder / "depth"}),
              HasSubstr("depth of 640x400, expected 1296x968 as the colour image"));
}

TEST(SubFolders, AreNamedWithTheCommandForThem) {
  const TemporaryFolder folder;
  make_pair_folders(folder, 3);
  const std::string pair = "for a stereo pair say waymark run " + (folder / "left").string() + " " +
                           (folder / "right").string();
  EXPECT_THAT(open_error(folder.path()),
              HasSubstr("holds no image itself, but left/ and right/ hold 3 images each: " + pair));
  std::filesystem::remove_all(folder / "left");
  EXPECT_THAT(open_error(folder.path()),
              HasSubstr("but right/ holds 3 images, expected one: for example waymark run " +
                        (folder / "right").string()));
  std::filesystem::remove_all(folder / "right");
  EXPECT_THAT(open_error(folder.path()), HasSubstr("holds no image, expected png, jpg"));
}

TEST(SubFolders, AreFoundFurtherDown) {
  const TemporaryFolder folder;
  write_image(folder / "day/drive/cam_left/x/a.png", 8, 6, 10);
  write_image(folder / "day/drive/cam_right/x/a.png", 8, 6, 10);
  EXPECT_THAT(open_error(folder.path()),
              HasSubstr("but day/drive/cam_left/x/ and day/drive/cam_right/x/ hold 1 images each: "
                        "for a stereo pair say waymark run"));
}

TEST(TwoInputs, HaveToBeOfOneKind) {
  const TemporaryFolder folder;
  make_pair_folders(folder, 2);
  folder.write("right.mp4", "a video");
  EXPECT_THAT(open_error(folder / "left", {.right = folder / "right.mp4"}),
              HasSubstr("right.mp4: cannot go with an input of kind images, expected two folders"));
  EXPECT_THAT(open_error(folder / "right.mp4", {.depth = folder / "left"}),
              HasSubstr("--depth: cannot go with an input of kind video"));
  EXPECT_THAT(open_error(folder / "left", {.topics = {"/a"}}),
              HasSubstr("--topics: cannot go with"));
}

TEST(IncreasingTimes, AreTheLongestPart) {
  const auto used = [](const std::vector<std::int64_t>& times) {
    return increasing_times(times, "x", "images");
  };
  EXPECT_THAT(used({}), ElementsAre());
  EXPECT_THAT(used({5, 7, 9}), ElementsAre(0, 1, 2));
  // One time far ahead costs itself, not all that follow.
  EXPECT_THAT(used({1, 99, 2, 3, 4, 5, 6, 7, 8, 9}), ElementsAre(0, 2, 3, 4, 5, 6, 7, 8, 9));
  EXPECT_THAT(used({1, 2, 3, 3, 4, 5, 6, 7, 8, 9}), ElementsAre(0, 1, 2, 4, 5, 6, 7, 8, 9));
  EXPECT_THAT(input_error_of([&] {
                used({1, 2, 3, 4, 5, 1, 2, 3, 4, 5});
              }),
              HasSubstr("x: 5 of 10 images have a time that is not later"));
}

}  // namespace
}  // namespace waymark

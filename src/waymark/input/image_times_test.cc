// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/image_times.h"

#include <gmock/gmock.h>

#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/input/input.h"
#include "waymark/input/testing/images.h"

namespace waymark {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error_of;
using testing::TemporaryFolder;
using testing::write_image;

TEST(ImageTimes, AreInNamesOfNumbersOfThisCentury) {
  EXPECT_THAT(times_in_names({"a/1403636579763555584.png", "a/1403636579813555456.png"}).value(),
              ElementsAre(1403636579763555584, 1403636579813555456));
  EXPECT_THAT(times_in_names({"1403636579763555.jpg"}).value(), ElementsAre(1403636579763555000));
  EXPECT_THAT(times_in_names({"1403636579763.jpg"}).value(), ElementsAre(1403636579763000000));
  EXPECT_THAT(times_in_names({"1305031102.175304.png", "1305031102.2.png"}).value(),
              ElementsAre(1305031102175304000, 1305031102200000000));
}

TEST(ImageTimes, AreNotInOtherNames) {
  EXPECT_FALSE(times_in_names({"000001.png", "000002.png"}));
  EXPECT_FALSE(times_in_names({"1403636579763555584.png", "1403636579763.png"})) << "two units";
  EXPECT_FALSE(times_in_names({"1403636579763555584.png", "cover.png"}));
  EXPECT_FALSE(times_in_names({"99999999999999999999999.png"}));
  EXPECT_FALSE(times_in_names({"20261124060000.png"})) << "a date";
  EXPECT_FALSE(times_in_names({"1.5.png"}));
}

TEST(ImageTimes, OfNamesAreUsedUnlessTimesAreGiven) {
  const TemporaryFolder folder;
  write_image(folder / "a" / "1403636579763555584.png", 8, 6, 10);
  write_image(folder / "a" / "1403636579813555456.png", 8, 6, 20);
  EXPECT_EQ(open_input(folder / "a", {})->next()->timestamp_ns, 1403636579763555584);
  InputOptions options;
  options.fps = 10.0;
  EXPECT_EQ(open_input(folder / "a", options)->next()->timestamp_ns, 0);
  folder.write("times.txt", "1.5\n2.5\n");
  EXPECT_EQ(open_input(folder / "a", {})->next()->timestamp_ns, 1'500'000'000);
}

TEST(ImageList, HasAPathPerLineAndTimesWhereAllDo) {
  const ImageList list = parse_image_list("# mine\na/1 2.png\r\n\n  b.png\n", "list");
  EXPECT_THAT(list.images, ElementsAre("a/1 2.png", "b.png"));
  EXPECT_TRUE(list.times_ns.empty());
  const ImageList timed = parse_image_list("1.25 a b.png\n2e0\tc.png", "list");
  EXPECT_THAT(timed.images, ElementsAre("a b.png", "c.png"));
  EXPECT_THAT(timed.times_ns, ElementsAre(1'250'000'000, 2'000'000'000));
  const ImageList whole =
      parse_image_list("1403636579763555584 1.png\n1403636579813555456 2.png\n", "list");
  EXPECT_THAT(whole.times_ns, ElementsAre(1403636579763555584, 1403636579813555456));
  EXPECT_THAT(whole.images, ElementsAre("1.png", "2.png"));
  EXPECT_THAT(input_error_of([] { parse_image_list("1.5 a.png\nb.png\n", "list"); }),
              HasSubstr("list:2: has not a time, expected one in every line or in none"));
  EXPECT_THAT(input_error_of([] { parse_image_list("\n# nothing\n", "list"); }),
              HasSubstr("list: holds no line, expected one path"));
  EXPECT_THAT(parse_image_list("-1 a.png", "list").images, ElementsAre("-1 a.png"));
}

TEST(ImageList, IsAnInput) {
  const TemporaryFolder folder;
  write_image(folder / "a" / "x.png", 8, 6, 10);
  write_image(folder / "b" / "x.png", 8, 6, 20);
  InputOptions options;
  options.image_list = "3.5 " + (folder / "b" / "x.png").string() + "\n4 " +
                       (folder / "a" / "x.png").string() + "\n";
  const auto input = open_input("-", options);
  EXPECT_THAT(input->info().lines, Contains("standard input: list of images (mono)"));
  const InputFrame first = input->next().value();
  EXPECT_EQ(first.timestamp_ns, 3'500'000'000);
  EXPECT_EQ(first.images.at(0).view().at(0, 0), 20);
  EXPECT_EQ(input->next()->images.at(0).view().at(0, 0), 10);
  options.image_list = "gone.png\n";
  EXPECT_THAT(input_error_of([&] { open_input("-", options); }), HasSubstr("gone.png: missing"));
  EXPECT_THAT(input_error_of([] { open_input("-", {}); }), HasSubstr("holds no line"));
}

}  // namespace
}  // namespace waymark

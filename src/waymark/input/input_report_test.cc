// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/input_report.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

InputInfo some_input() {
  InputInfo info;
  info.format = "bag";
  info.num_frames = 4;
  info.width_px = 8;
  info.height_px = 6;
  info.times_ns = {1'000'000'000, 1'100'000'000, 1'400'000'000, 1'500'000'000};
  info.topics = {{"/camera/image_raw", "sensor_msgs/Image", 4, true}};
  info.counts.out_of_order = 2;
  info.lines = {"a.bag: ROS 1 bag (mono)"};
  return info;
}

TEST(InputReport, FindsGaps) {
  const std::vector<InputGap> gaps = find_gaps(some_input().times_ns);
  ASSERT_EQ(gaps.size(), 1U);
  EXPECT_EQ(gaps[0].index, 1U);
  EXPECT_EQ(gaps[0].duration_ns, 300'000'000);
  EXPECT_THAT(find_gaps({}), IsEmpty());
  EXPECT_THAT(find_gaps({5}), IsEmpty());
  EXPECT_THAT(find_gaps({0, 10, 24, 34}), IsEmpty()) << "a late frame is no missing one";
}

TEST(InputReport, TellsWhatIsInside) {
  const std::string text = format_input(some_input());
  EXPECT_THAT(text, HasSubstr("a.bag: ROS 1 bag (mono)\n"));
  EXPECT_THAT(text, HasSubstr("gaps: 1\n  0.300 s after frame 1, at 1.100000000 s\n"));
  EXPECT_THAT(text, HasSubstr("  /camera/image_raw: sensor_msgs/Image, 4 messages, used\n"));
}

TEST(InputReport, IsJsonToo) {
  const nlohmann::json json = nlohmann::json::parse(format_input_json(some_input()));
  EXPECT_EQ(json["format"], "bag");
  EXPECT_EQ(json["setup"], "mono");
  EXPECT_EQ(json["frames"], 4);
  EXPECT_DOUBLE_EQ(json["rate_hz"], 6.0);
  EXPECT_EQ(json["cameras"][0]["width_px"], 8);
  EXPECT_TRUE(json["cameras"][0]["calibration"].is_null());
  EXPECT_EQ(json["gaps"][0]["after_frame"], 1);
  EXPECT_EQ(json["out_of_order"], 2);
  EXPECT_EQ(json["topics"][0]["is_used"], true);

  InputInfo video;
  video.calibration.emplace();
  video.calibration->cameras.resize(1);
  video.calibration->cameras[0].description.camera_model = "pinhole";
  const nlohmann::json untimed = nlohmann::json::parse(format_input_json(video));
  EXPECT_TRUE(untimed["frames"].is_null());
  EXPECT_TRUE(untimed["rate_hz"].is_null());
  EXPECT_EQ(untimed["cameras"][0]["calibration"]["model"], "pinhole");
}

}  // namespace
}  // namespace waymark

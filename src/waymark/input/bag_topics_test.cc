// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/bag_topics.h"

#include <gmock/gmock.h>

#include "waymark/base/testing/errors.h"
#include "waymark/input/pairing.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error_of;

ImageTopic image(const std::string& name, const std::string& frame = "", bool is_depth = false) {
  return {0, name, frame, is_depth ? "16UC1" : "mono8", is_depth, 10};
}

/// "mono /a", "stereo /a /b", ...
std::vector<std::string> found(const std::vector<ImageTopic>& topics) {
  std::vector<std::string> texts;
  for (const TopicChoice& choice : find_topics(topics)) {
    texts.push_back(std::string(to_string(choice.setup)) + " " + choice.first.name +
                    (choice.second ? " " + choice.second->name : ""));
  }
  return texts;
}

TEST(BagTopics, KnowsLeftFromRight) {
  EXPECT_TRUE(are_left_and_right("/stereo/left/image_raw", "/stereo/right/image_raw"));
  EXPECT_TRUE(are_left_and_right("/camera/infra1/image_rect_raw", "/camera/infra2/image_rect_raw"));
  EXPECT_TRUE(are_left_and_right("/cam0/image_raw", "/cam1/image_raw"));
  EXPECT_FALSE(are_left_and_right("/cam1/image_raw", "/cam0/image_raw"));
  EXPECT_FALSE(are_left_and_right("/cam0/image_raw", "/cam2/image_raw"));
  EXPECT_FALSE(are_left_and_right("/cam1/image0", "/cam2/image1"));
  EXPECT_FALSE(are_left_and_right("/cam00", "/cam10")) << "0 and 10 are no neighbours";
  EXPECT_FALSE(are_left_and_right("/a", "/a"));
}

TEST(BagTopics, TakesTheOneCameraThereIs) {
  EXPECT_THAT(found({image("/camera/image_raw")}), ElementsAre("mono /camera/image_raw"));
  EXPECT_THAT(found({image("/camera/image_rect"),
                     image("/camera/image_raw/compressed"),
                     image("/camera/image_raw")}),
              ElementsAre("mono /camera/image_raw"));
  EXPECT_THAT(found({image("/camera/image_raw/compressed")}),
              ElementsAre("mono /camera/image_raw/compressed"));
  EXPECT_THAT(found({image("/camera/image_mono"), image("/camera/image_color")}),
              ElementsAre("mono /camera/image_color"));
}

TEST(BagTopics, ChoosesNoneOfSeveralCameras) {
  EXPECT_THAT(found({image("/front/image_raw"), image("/back/image_raw")}), ElementsAre());
  EXPECT_THAT(found({}), ElementsAre());
}

TEST(BagTopics, FindsPairs) {
  EXPECT_THAT(found({image("/cam1/image_raw"), image("/cam0/image_raw")}),
              ElementsAre("mono /cam0/image_raw", "stereo /cam0/image_raw /cam1/image_raw"));
}

TEST(BagTopics, FindsDepthThatIsRegistered) {
  const std::vector<ImageTopic> realsense = {
      image("/camera/depth/image_rect_raw", "depth_frame", true),
      image("/camera/aligned_depth_to_color/image_raw", "color_frame", true),
      image("/camera/color/image_raw", "color_frame"),
      image("/camera/infra1/image_rect_raw", "depth_frame"),
      image("/camera/infra2/image_rect_raw", "infra2_frame")};
  EXPECT_THAT(found(realsense),
              ElementsAre("mono /camera/color/image_raw",
                          "stereo /camera/infra1/image_rect_raw /camera/infra2/image_rect_raw",
                          "rgbd /camera/color/image_raw /camera/aligned_depth_to_color/image_raw"));
  EXPECT_THAT(
      found({image("/camera/rgb/image_color", "rgb"), image("/camera/depth/image", "rgb", true)}),
      ElementsAre("mono /camera/rgb/image_color",
                  "rgbd /camera/rgb/image_color /camera/depth/image"));
  EXPECT_THAT(found({image("/camera/color/image_raw", "color"),
                     image("/camera/depth/image_raw", "depth", true)}),
              ElementsAre("mono /camera/color/image_raw"))
      << "depth of another camera";
}

TEST(BagTopics, TakesThoseThatAreNamed) {
  const std::vector<ImageTopic> topics = {image("/a"), image("/b"), image("/d", "", true)};
  EXPECT_EQ(choose_named_topics(topics, {"/b"}, "bag").setup, Setup::kMono);
  EXPECT_EQ(choose_named_topics(topics, {"/b", "/a"}, "bag").setup, Setup::kStereo);
  EXPECT_EQ(choose_named_topics(topics, {"/b", "/d"}, "bag").setup, Setup::kRgbd);
  EXPECT_THAT(
      input_error_of([&] { choose_named_topics(topics, {"/c"}, "x.bag"); }),
      HasSubstr("'/c' is no topic of images in x.bag, expected of /a (mono8, 10 messages)"));
  EXPECT_THAT(input_error_of([&] { choose_named_topics(topics, {"/d"}, "x.bag"); }),
              HasSubstr("expected one or two"));
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/bag/ros_messages.h"

#include <gmock/gmock.h>

#include <numeric>

#include "waymark/bag/testing/message_writer.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using testing::write_message;

RosCameraInfo some_info() {
  RosCameraInfo info;
  info.frame_id = "left";  // Five bytes with its zero: what follows has to be aligned.
  info.height_px = 480;
  info.width_px = 640;
  info.distortion_model = "plumb_bob";
  info.d = {0.1, -0.2, 0.001, 0.002, 0.0};
  std::iota(info.k.begin(), info.k.end(), 100.0);
  std::iota(info.r.begin(), info.r.end(), 200.0);
  std::iota(info.p.begin(), info.p.end(), 300.0);
  info.binning_x = 2;
  info.roi_y_px = 3;
  info.roi_width_px = 4;
  return info;
}

class Messages : public ::testing::TestWithParam<RosEncoding> {};

TEST_P(Messages, OfAnImageComeBack) {
  const RosImage image{"camera", 2, 3, "mono8", true, 4, "abcdefgh"};
  const std::string bytes = write_message(GetParam(), 1'500'000'000, image);
  const auto parsed = parse_ros_image(bytes, GetParam());
  ASSERT_TRUE(parsed);
  EXPECT_EQ(parsed->frame_id, "camera");
  EXPECT_EQ(parsed->height_px, 2U);
  EXPECT_EQ(parsed->width_px, 3U);
  EXPECT_EQ(parsed->encoding, "mono8");
  EXPECT_TRUE(parsed->is_bigendian);
  EXPECT_EQ(parsed->step, 4U);
  EXPECT_EQ(parsed->data, "abcdefgh");
}

TEST_P(Messages, OfACameraInfoComeBack) {
  const RosCameraInfo info = some_info();
  const auto parsed = parse_ros_camera_info(write_message(GetParam(), 5, info), GetParam());
  ASSERT_TRUE(parsed);
  EXPECT_EQ(parsed->frame_id, "left");
  EXPECT_EQ(parsed->width_px, 640U);
  EXPECT_EQ(parsed->d, info.d);
  EXPECT_EQ(parsed->k, info.k);
  EXPECT_EQ(parsed->r, info.r);
  EXPECT_EQ(parsed->p, info.p);
  EXPECT_EQ(parsed->binning_x, 2U);
  EXPECT_EQ(parsed->roi_y_px, 3U);
  EXPECT_EQ(parsed->roi_width_px, 4U);
}

TEST_P(Messages, OfAnImuComeBack) {
  const RosImu imu{{0.1, 0.2, 0.3}, {1, 2, 9.8}, true, false};
  const std::string bytes = write_message(GetParam(), 5, imu);
  const auto parsed = parse_ros_imu(bytes, GetParam());
  ASSERT_TRUE(parsed);
  EXPECT_EQ(parsed->angular_velocity, imu.angular_velocity);
  EXPECT_EQ(parsed->linear_acceleration, imu.linear_acceleration);
  EXPECT_TRUE(parsed->has_angular_velocity);
  EXPECT_FALSE(parsed->has_linear_acceleration);
  EXPECT_LT(bytes.size(), kImuStartBytes);
  for (std::size_t size = 0; size < bytes.size() - 9 * sizeof(double); ++size) {
    EXPECT_FALSE(parse_ros_imu(std::string_view(bytes).substr(0, size), GetParam())) << size;
  }
}

TEST_P(Messages, CutOffAnywhereAreNone) {
  const std::string bytes = write_message(GetParam(), 5, some_info());
  for (std::size_t size = 0; size + 1 < bytes.size(); ++size) {  // The last byte is not needed.
    EXPECT_FALSE(parse_ros_camera_info(std::string_view(bytes).substr(0, size), GetParam()))
        << size;
  }
}

TEST_P(Messages, WithLengthsBeyondTheirEndAreNone) {
  std::string bytes = write_message(GetParam(), 5, RosCompressedImage{"f", "jpeg", "12345678"});
  bytes[bytes.size() - 9] = '\x7F';
  EXPECT_FALSE(parse_ros_compressed_image(bytes, GetParam()));
}

INSTANTIATE_TEST_SUITE_P(Ros, Messages, ::testing::Values(RosEncoding::kRos1, RosEncoding::kCdr));

TEST(Messages, OfOtherByteOrderAreNone) {
  std::string bytes =
      write_message(RosEncoding::kCdr, 5, RosImage{"f", 1, 1, "mono8", false, 1, "a"});
  bytes[1] = '\0';
  EXPECT_FALSE(parse_ros_image(bytes, RosEncoding::kCdr));
}

}  // namespace
}  // namespace waymark

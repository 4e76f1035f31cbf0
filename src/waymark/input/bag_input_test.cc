// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Bags of ROS as an input, written by the tests.
#include <gmock/gmock.h>

#include "waymark/bag/testing/bag_writer.h"
#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/input/input.h"

namespace waymark {
namespace {

using ::testing::Contains;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error_of;
using testing::make_mcap;
using testing::make_ros1_bag;
using ::testing::SizeIs;
using testing::TemporaryFolder;
using testing::write_bytes;
using testing::write_message;
using testing::WrittenMessage;

constexpr std::int64_t kStartNs = 1'700'000'000'000'000'000;
constexpr std::int64_t kFrameNs = 50'000'000;

RosCameraInfo info_of(double p3 = 0.0) {
  RosCameraInfo info;
  info.frame_id = "camera";
  info.width_px = 8;
  info.height_px = 6;
  info.distortion_model = "plumb_bob";
  info.d = {0.1, 0.01, 0.001, 0.002, 0.0};
  info.k = {10, 0, 4, 0, 11, 3, 0, 0, 1};
  info.r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.p = {9, 0, 3.5, p3, 0, 9, 2.5, 0, 0, 0, 1, 0};
  return info;
}

/// Messages of ROS 2 unless told otherwise, in the order they are added.
struct Recording {
  RosEncoding encoding = RosEncoding::kCdr;
  std::vector<WrittenMessage> messages = {};

  /// An even image of 8x6 px.
  Recording& image(const std::string& topic, std::int64_t time_ns, int value) {
    const std::string pixels(48, static_cast<char>(value));
    return add(
        topic, "sensor_msgs/Image", time_ns, RosImage{"camera", 6, 8, "mono8", false, 8, pixels});
  }
  Recording& depth(const std::string& topic, std::int64_t time_ns) {
    const std::string pixels(96, '\x04');
    return add(
        topic, "sensor_msgs/Image", time_ns, RosImage{"camera", 6, 8, "16UC1", false, 16, pixels});
  }
  Recording& info(const std::string& topic, const RosCameraInfo& info) {
    return add(topic, "sensor_msgs/CameraInfo", kStartNs, info);
  }
  template <class Message>
  Recording& add(const std::string& topic,
                 const std::string& type,
                 std::int64_t time_ns,
                 const Message& message) {
    messages.push_back(
        {topic, type, time_ns + 1'000'000, write_message(encoding, time_ns, message)});
    return *this;
  }
};

Recording mono() {
  Recording recording;
  recording.info("/camera/camera_info", info_of());
  for (int i = 0; i < 4; ++i) recording.image("/camera/image_raw", kStartNs + i * kFrameNs, 10 + i);
  return recording;
}

/// The right images come 2 ms later. The third has none.
Recording stereo(double p3 = -1.8) {
  Recording recording;
  recording.info("/left/camera_info", info_of()).info("/right/camera_info", info_of(p3));
  for (int i = 0; i < 4; ++i) {
    const std::int64_t time_ns = kStartNs + i * kFrameNs;
    recording.image("/left/image_raw", time_ns, 10 + i);
    if (i != 2) recording.image("/right/image_raw", time_ns + 2'000'000, 20 + i);
  }
  return recording;
}

std::unique_ptr<Input> open(const TemporaryFolder& folder,
                            const Recording& recording,
                            const InputOptions& options = {}) {
  write_bytes(folder / "a.mcap", make_mcap(recording.messages, Compression::kZstd));
  return open_input(folder / "a.mcap", options);
}

std::vector<InputFrame> all_frames(Input& input) {
  std::vector<InputFrame> frames;
  while (auto frame = input.next()) frames.push_back(*std::move(frame));
  return frames;
}

TEST(BagInput, GivesImagesWithTheTimesOfTheirHeaders) {
  const TemporaryFolder folder;
  const auto input = open(folder, mono());
  EXPECT_EQ(input->info().format, "bag");
  EXPECT_EQ(input->info().setup, Setup::kMono);
  EXPECT_EQ(input->info().num_frames, 4U);
  EXPECT_EQ(input->info().width_px, 8);
  const std::vector<InputFrame> frames = all_frames(*input);
  ASSERT_EQ(frames.size(), 4U);
  EXPECT_EQ(frames[3].timestamp_ns, kStartNs + 3 * kFrameNs);
  EXPECT_THAT(frames[3].images.at(0).values, Each(13));
}

TEST(BagInput, ReadsBagsOfRos1) {
  const TemporaryFolder folder;
  Recording recording;
  recording.encoding = RosEncoding::kRos1;
  recording.image("/camera/image_raw", kStartNs, 5).image("/camera/image_raw", kStartNs + 1, 6);
  write_bytes(folder / "a.bag", make_ros1_bag(recording.messages, Compression::kLz4));
  const auto input = open_input(folder / "a.bag", {});
  EXPECT_THAT(all_frames(*input).at(1).images.at(0).values, Each(6));
  EXPECT_FALSE(input->info().calibration);
}

TEST(BagInput, TakesPartOfTheFrames) {
  const TemporaryFolder folder;
  const auto input = open(folder, mono(), {.first = 1, .every = 2, .has_jpeg = true});
  const std::vector<InputFrame> frames = all_frames(*input);
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames[1].index, 3U);
  EXPECT_TRUE(frames[1].jpeg.starts_with("\xFF\xD8"));
}

TEST(BagInput, TakesTheCalibrationOfRawAndOfRectifiedImages) {
  const TemporaryFolder folder;
  const CameraChain raw = open(folder, mono())->info().calibration.value();
  EXPECT_EQ(raw.cameras.at(0).description.intrinsics, (std::vector<double>{10, 11, 4, 3}));
  EXPECT_EQ(raw.cameras.at(0).description.distortion_model, "radtan");
  EXPECT_FALSE(raw.depth_factor);

  Recording recording;
  recording.info("/camera/camera_info", info_of()).image("/camera/image_rect", kStartNs, 1);
  const CameraChain rectified = open(folder, recording)->info().calibration.value();
  EXPECT_EQ(rectified.cameras.at(0).description.intrinsics, (std::vector<double>{9, 9, 3.5, 2.5}));
  EXPECT_EQ(rectified.cameras.at(0).description.distortion_model, "none");
}

TEST(BagInput, HalvesTheCalibrationOfBinnedImages) {
  const TemporaryFolder folder;
  RosCameraInfo info = info_of();
  info.width_px = 20;
  info.height_px = 14;
  info.binning_x = info.binning_y = 2;
  info.roi_x_px = 4;
  info.roi_width_px = 16;
  info.roi_height_px = 12;
  Recording recording;
  recording.info("/camera/camera_info", info).image("/camera/image_raw", kStartNs, 1);
  const CameraChain chain = open(folder, recording)->info().calibration.value();
  EXPECT_EQ(chain.cameras.at(0).description.intrinsics, (std::vector<double>{5, 5.5, 0, 1.5}));
}

TEST(BagInput, PairsLeftWithRight) {
  const TemporaryFolder folder;
  const auto input = open(folder, stereo());
  EXPECT_EQ(input->info().setup, Setup::kStereo);
  EXPECT_NEAR((input->info().calibration->cameras.at(1).cam_from_rig.translation -
               Eigen::Vector3d(-0.2, 0, 0))
                  .norm(),
              0.0,
              1e-12);
  const std::vector<InputFrame> frames = all_frames(*input);
  ASSERT_EQ(frames.size(), 4U);
  EXPECT_THAT(frames[1].images, SizeIs(2));
  EXPECT_THAT(frames[1].images[1].values, Each(21));
  EXPECT_THAT(frames[2].images, SizeIs(1)) << "has no partner";
  EXPECT_EQ(frames[2].fault, FrameFault::kNone);
  EXPECT_EQ(input->info().counts.without_partner, 1U);
  const auto later = open(folder, stereo(), {.first = 2});
  EXPECT_EQ(later->next()->fault, FrameFault::kUnreadable) << "no scale to begin with";
  EXPECT_EQ(later->next()->images.size(), 2U);
}

TEST(BagInput, TurnsRawPairsAsTheirRectificationSays) {
  const TemporaryFolder folder;
  RosCameraInfo right = info_of(-1.8);
  const double c = std::cos(0.1);
  const double s = std::sin(0.1);
  right.r = {c, 0, s, 0, 1, 0, -s, 0, c};
  Recording recording;
  recording.info("/left/camera_info", info_of()).info("/right/camera_info", right);
  recording.image("/left/image_raw", kStartNs, 1).image("/right/image_raw", kStartNs, 1);
  recording.image("/left/image_raw", kStartNs + kFrameNs, 1);
  const Rigid3 pose = open(folder, recording)->info().calibration->cameras.at(1).cam_from_rig;
  // A point 2 m ahead of the left camera, in the rectified frame of the right one and turned back.
  const Eigen::Vector3d in_right = pose * Eigen::Vector3d(0, 0, 2);
  EXPECT_NEAR((in_right - Eigen::Vector3d(-0.2 * c - 2 * s, 0, -0.2 * s + 2 * c)).norm(), 0, 1e-12);
}

TEST(BagInput, UsesOneOfAPairWithoutABaseline) {
  const TemporaryFolder folder;
  const auto input = open(folder, stereo(0.0));
  EXPECT_EQ(input->info().setup, Setup::kMono);
  EXPECT_THAT(input->info().lines,
              Contains(HasSubstr("/right/image_raw is not used: nothing says")));
  const auto asked = open(folder, stereo(0.0), {.setup = Setup::kStereo});
  EXPECT_EQ(asked->info().setup, Setup::kStereo);
  EXPECT_FALSE(asked->info().calibration) << "so that it is asked for";
}

TEST(BagInput, LeavesOutWhatComesBeforeTheOtherCamera) {
  const TemporaryFolder folder;
  Recording recording = stereo();
  std::erase_if(recording.messages, [](const auto& message) {
    return message.topic == "/right/image_raw" && message.recorded_ns < kStartNs + kFrameNs;
  });
  const auto input = open(folder, recording);
  EXPECT_EQ(input->info().num_frames, 3U);
  EXPECT_EQ(input->next()->timestamp_ns, kStartNs + kFrameNs);
  EXPECT_THAT(input->info().lines, Contains(HasSubstr("1 frames at the start are left out")));
}

TEST(BagInput, TakesDepthInMillimetres) {
  const TemporaryFolder folder;
  Recording recording;
  recording.info("/camera/color/camera_info", info_of());
  for (int i = 0; i < 3; ++i) {
    recording.image("/camera/color/image_raw", kStartNs + i * kFrameNs, 10);
    recording.depth("/camera/aligned_depth_to_color/image_raw", kStartNs + i * kFrameNs + 7);
  }
  const auto input = open(folder, recording);
  EXPECT_EQ(input->info().setup, Setup::kRgbd);
  EXPECT_EQ(input->info().calibration->depth_factor, 1000.0);
  const InputFrame frame = input->next().value();
  EXPECT_THAT(frame.depth->values, Each(0x0404));
  EXPECT_EQ(frame.depth_lag_ns, 7);
  const auto mono = open(folder, recording, {.setup = Setup::kMono});
  EXPECT_FALSE(mono->next()->depth);
}

/// As the recorder of RealSense names topics.
Recording realsense() {
  Recording recording{RosEncoding::kRos1};
  RosCameraInfo info = info_of();
  info.frame_id = "0";
  info.distortion_model = "Brown Conrady";
  const std::string sensors[] = {
      "sensor_0/Depth_0", "sensor_0/Infrared_1", "sensor_0/Infrared_2", "sensor_1/Color_0"};
  for (const std::string& sensor : sensors) {
    recording.info("/device_0/" + sensor + "/info/camera_info", info);
  }
  for (int i = 0; i < 4; ++i) {
    const std::int64_t time_ns = kStartNs + i * kFrameNs;
    for (int k = 1; k < 4; ++k) {
      recording.image("/device_0/" + sensors[k] + "/image/data", time_ns, 10 * k + i);
    }
    recording.add("/device_0/" + sensors[0] + "/image/data",
                  "sensor_msgs/Image",
                  time_ns,
                  RosImage{"0", 6, 8, "mono16", false, 16, std::string(96, '\x04')});
  }
  return recording;
}

TEST(BagInput, TakesTheColourOfRecordingsOfRealSense) {
  const TemporaryFolder folder;
  write_bytes(folder / "a.bag", make_ros1_bag(realsense().messages, Compression::kLz4));
  auto input = open_input(folder / "a.bag", {});
  EXPECT_EQ(input->info().setup, Setup::kMono);
  EXPECT_THAT(input->next()->images.at(0).values, Each(30));
  EXPECT_EQ(input->info().calibration->cameras[0].description.distortion_model, "radtan");

  // Depth is that of the left infrared camera.
  InputOptions options;
  options.topics = {"/device_0/sensor_0/Infrared_1/image/data",
                    "/device_0/sensor_0/Depth_0/image/data"};
  input = open_input(folder / "a.bag", options);
  EXPECT_EQ(input->info().setup, Setup::kRgbd);
  EXPECT_THAT(input->next()->depth->values, Each(0x0404));

  // A pair with a calibration of both.
  options.topics = {};
  options.calibration = input->info().calibration;
  options.calibration->cameras.push_back(options.calibration->cameras[0]);
  options.calibration->cameras[1].cam_from_rig.translation.x() = -0.05;
  input = open_input(folder / "a.bag", options);
  EXPECT_EQ(input->info().setup, Setup::kStereo);
  EXPECT_THAT(input->next()->images.at(1).values, Each(20));
}

TEST(BagInput, ListsTopicsAndSaysWhatItDoesNotUse) {
  const TemporaryFolder folder;
  Recording recording = mono();
  recording.messages.push_back({"/imu", "sensor_msgs/Imu", kStartNs, "unread"});
  const auto input = open(folder, recording);
  ASSERT_THAT(input->info().topics, SizeIs(3));
  EXPECT_TRUE(input->info().topics[1].is_used);
  EXPECT_EQ(input->info().topics[1].num_messages, 4U);
  EXPECT_FALSE(input->info().topics[2].is_used);
  EXPECT_THAT(input->info().lines, Contains(HasSubstr("left out: /imu: has no turns")));
}

TEST(BagInput, LeavesOutDoubleTimes) {
  const TemporaryFolder folder;
  Recording recording;
  for (int i = 0; i < 20; ++i) recording.image("/camera/image_raw", kStartNs + i * kFrameNs, i);
  recording.image("/camera/image_raw", kStartNs + 19 * kFrameNs, 77);
  const auto input = open(folder, recording);
  EXPECT_EQ(input->info().num_frames, 20U);
  EXPECT_EQ(input->info().counts.out_of_order, 1U);
  for (int i = 0; i < 4; ++i) recording.image("/camera/image_raw", kStartNs, 77);
  EXPECT_THAT(input_error_of([&] { open(folder, recording); }),
              HasSubstr("5 of 25 messages have a time that is not later"));
}

TEST(BagInput, SkipsDamagedImages) {
  const TemporaryFolder folder;
  Recording recording = mono();
  recording.add("/camera/image_raw",
                "sensor_msgs/Image",
                kStartNs + 9 * kFrameNs,
                RosImage{"camera", 600, 8, "mono8", false, 8, "too few"});
  const std::vector<InputFrame> frames = all_frames(*open(folder, recording));
  ASSERT_EQ(frames.size(), 5U);
  EXPECT_EQ(frames[4].fault, FrameFault::kUnreadable);
  EXPECT_THAT(
      frames[4].warning,
      HasSubstr("a.mcap: /camera/image_raw at 1700000000.450000000 s: an image of 8x600 px"));
}

TEST(BagInput, SaysWhatItExpected) {
  const TemporaryFolder folder;
  Recording none;
  none.messages.push_back({"/imu", "sensor_msgs/Imu", kStartNs, "unread"});
  EXPECT_THAT(input_error_of([&] { open(folder, none); }),
              HasSubstr("expected images; its topics: /imu (sensor_msgs/Imu)"));
  Recording many;
  many.image("/front/image_raw", kStartNs, 1).image("/back/image_raw", kStartNs, 1);
  EXPECT_THAT(input_error_of([&] { open(folder, many); }), HasSubstr("expected --topics A[,B]"));
  EXPECT_EQ(open(folder, many, {.topics = {"/back/image_raw"}})->info().num_frames, 1U);
  EXPECT_THAT(input_error_of([&] { open(folder, mono(), {.setup = Setup::kStereo}); }),
              HasSubstr("does not offer stereo"));
  RosCameraInfo wrong = info_of();
  wrong.width_px = 9;
  Recording other;
  other.info("/camera/camera_info", wrong).image("/camera/image_raw", kStartNs, 1);
  EXPECT_THAT(input_error_of([&] { open(folder, other); }),
              HasSubstr("is 8x6 px, expected 9x6 px as the calibration of camera 0 says"));
}

}  // namespace
}  // namespace waymark

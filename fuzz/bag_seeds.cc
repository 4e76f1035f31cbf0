// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Writes small sound bags for the fuzzer of bags to start from: waymark_bag_seeds FOLDER.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include "waymark/bag/testing/bag_writer.h"

namespace {

using namespace waymark;

/// Two images of a pair, colour with depth, and what tells of the camera.
std::vector<testing::WrittenMessage> small_recording(RosEncoding encoding) {
  std::vector<testing::WrittenMessage> messages;
  RosCameraInfo info;
  info.width_px = 4;
  info.height_px = 2;
  info.distortion_model = "plumb_bob";
  info.k = {4, 0, 2, 0, 4, 1, 0, 0, 1};
  info.p = {4, 0, 2, -1, 0, 4, 1, 0, 0, 0, 1, 0};
  const auto add = [&](const std::string& topic, const std::string& type, const auto& message) {
    const auto time_ns = static_cast<std::int64_t>(messages.size() + 1);
    messages.push_back({topic, type, time_ns, testing::write_message(encoding, time_ns, message)});
  };
  for (const char* side : {"/left", "/right"}) {
    add(std::string(side) + "/camera_info", "sensor_msgs/CameraInfo", info);
    add(std::string(side) + "/image_raw",
        "sensor_msgs/Image",
        RosImage{"f", 2, 4, "mono8", false, 4, "abcdefgh"});
  }
  add("/depth", "sensor_msgs/Image", RosImage{"f", 2, 4, "16UC1", true, 8, "abcdefghabcdefgh"});
  add("/packed", "sensor_msgs/CompressedImage", RosCompressedImage{"f", "jpeg", "\xFF\xD8\xFF"});
  add("/imu", "sensor_msgs/Imu", RosImu{{0.1, 0.2, 0.3}, {0, 0, 9.8}});
  add("/imu", "sensor_msgs/Imu", RosImu{{0.1, 0.2, 0.3}, {0, 0, 9.8}});
  return messages;
}

void write_seeds(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  const auto ros2 = small_recording(RosEncoding::kCdr);
  const auto ros1 = small_recording(RosEncoding::kRos1);
  testing::write_bytes(folder / "plain.mcap", testing::make_mcap(ros2));
  testing::write_bytes(folder / "lz4.mcap", testing::make_mcap(ros2, Compression::kLz4));
  testing::write_bytes(folder / "zstd.mcap", testing::make_mcap(ros2, Compression::kZstd));
  testing::write_bytes(folder / "plain.bag", testing::make_ros1_bag(ros1));
  testing::write_bytes(folder / "lz4.bag", testing::make_ros1_bag(ros1, Compression::kLz4));
  testing::write_bytes(folder / "bz2.bag", testing::make_ros1_bag(ros1, Compression::kBz2));
  std::filesystem::remove(folder / "a.db3");
  testing::write_sqlite_bag(folder / "a.db3", ros2);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: %s FOLDER\n", argv[0]);
    return 2;
  }
  try {
    write_seeds(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}

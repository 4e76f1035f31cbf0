// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace waymark {

enum class RosEncoding;

// Messages of ROS: as ROS 1 serialises them, and in CDR (the "plain CDR" of OMG's DDS-XTypes, least
// significant byte first) as ROS 2 does. Sequences are views of the bytes of the message.

/// sensor_msgs/Image.
struct RosImage {
  std::string frame_id;
  std::uint32_t height_px = 0;
  std::uint32_t width_px = 0;
  std::string encoding;  ///< "mono8", "bgr8", ...
  bool is_bigendian = false;
  std::uint32_t step = 0;  ///< Bytes from row to row.
  std::string_view data;
};

inline constexpr std::string_view kRosCompressedImage = "sensor_msgs/CompressedImage";
inline constexpr std::string_view kRosCompressedVideo = "foxglove_msgs/CompressedVideo";
inline constexpr std::string_view kRosFfmpegPacket = "ffmpeg_image_transport_msgs/FFMPEGPacket";

/// One of these three.
struct RosCompressedImage {
  std::string frame_id;
  std::string format;  ///< "jpeg", "16UC1; compressedDepth png", "h264", ...
  std::string_view data;
};

/// sensor_msgs/CameraInfo.
struct RosCameraInfo {
  std::string frame_id;
  std::uint32_t height_px = 0;
  std::uint32_t width_px = 0;
  std::string distortion_model;
  std::vector<double> d;
  std::array<double, 9> k = {};   ///< Row by row.
  std::array<double, 9> r = {};   ///< Row by row: what rectifies, rectified_from_cam.
  std::array<double, 12> p = {};  ///< Row by row: of the rectified image.
  std::uint32_t binning_x = 0;    ///< 0 as 1.
  std::uint32_t binning_y = 0;
  std::uint32_t roi_x_px = 0;
  std::uint32_t roi_y_px = 0;
  std::uint32_t roi_height_px = 0;  ///< 0: the whole image.
  std::uint32_t roi_width_px = 0;
};

/// sensor_msgs/Imu. What the message says it has not (REP 145: the first covariance is -1) is not
/// there.
struct RosImu {
  std::array<double, 3> angular_velocity = {};     ///< rad/s.
  std::array<double, 3> linear_acceleration = {};  ///< m/s^2, with gravity.
  bool has_angular_velocity = true;
  bool has_linear_acceleration = true;
};

/// Each gives nothing for bytes that are no such message.
std::optional<RosImage> parse_ros_image(std::string_view bytes, RosEncoding encoding);
std::optional<RosCompressedImage> parse_ros_compressed_image(
    std::string_view bytes, RosEncoding encoding, std::string_view type = kRosCompressedImage);
std::optional<RosCameraInfo> parse_ros_camera_info(std::string_view bytes, RosEncoding encoding);
/// The covariance of the acceleration, the last field, need not be there.
std::optional<RosImu> parse_ros_imu(std::string_view bytes, RosEncoding encoding);

}  // namespace waymark

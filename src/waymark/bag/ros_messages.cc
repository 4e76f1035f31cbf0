// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/bag/ros_messages.h"

#include <bit>

#include "waymark/bag/bag_content.h"
#include "waymark/bag/byte_source.h"

namespace waymark {
namespace {

/// Reads the fields of a message in their order.
class MessageReader {
 public:
  MessageReader(std::string_view bytes, RosEncoding encoding)
      : is_cdr_(encoding == RosEncoding::kCdr), reader_(bytes) {
    if (!is_cdr_) return;
    constexpr std::string_view kPlainCdr("\0\1", 2);
    is_known_ = reader_.take(2) == kPlainCdr;
    reader_.take(2);  // Options.
    num_bytes_ = reader_.rest().size();
  }

  template <class Number>
  Number number() {
    align(sizeof(Number));
    if constexpr (sizeof(Number) == sizeof(double) && !std::is_integral_v<Number>) {
      return std::bit_cast<double>(reader_.number<std::uint64_t>());
    } else {
      return reader_.number<Number>();
    }
  }

  std::string string() {
    std::string_view text = bytes();
    if (is_cdr_ && !text.empty()) text.remove_suffix(1);  // Its zero.
    return std::string(text);
  }

  std::string_view bytes() { return reader_.take(number<std::uint32_t>()); }

  std::vector<double> doubles() {
    std::vector<double> values;
    const auto count = number<std::uint32_t>();
    for (std::uint32_t i = 0; i < count && is_good(); ++i) values.push_back(number<double>());
    return values;
  }

  template <std::size_t kCount>
  void read(std::array<double, kCount>& values) {
    for (double& value : values) value = number<double>();
  }

  /// std_msgs/Header; gives the name of its coordinate frame.
  std::string header() {
    if (!is_cdr_) number<std::uint32_t>();  // Sequence number.
    return time_and_frame();
  }

  std::string time_and_frame() {
    number<std::uint32_t>();
    number<std::uint32_t>();
    return string();
  }

  bool is_good() const { return is_known_ && !reader_.has_failed(); }

 private:
  /// Numbers of CDR begin at multiples of their size, counted from what follows the first 4 bytes.
  void align(std::size_t size) {
    if (!is_cdr_) return;
    const std::size_t beyond = (num_bytes_ - reader_.rest().size()) % size;
    if (beyond > 0) reader_.take(size - beyond);
  }

  bool is_cdr_;
  bool is_known_ = true;
  FieldReader reader_;
  std::size_t num_bytes_ = 0;  ///< After the first 4.
};

}  // namespace

std::optional<RosImage> parse_ros_image(std::string_view bytes, RosEncoding encoding) {
  MessageReader reader(bytes, encoding);
  RosImage image;
  image.frame_id = reader.header();
  image.height_px = reader.number<std::uint32_t>();
  image.width_px = reader.number<std::uint32_t>();
  image.encoding = reader.string();
  image.is_bigendian = reader.number<std::uint8_t>() != 0;
  image.step = reader.number<std::uint32_t>();
  image.data = reader.bytes();
  return reader.is_good() ? std::optional(image) : std::nullopt;
}

std::optional<RosCompressedImage> parse_ros_compressed_image(std::string_view bytes,
                                                             RosEncoding encoding,
                                                             std::string_view type) {
  MessageReader reader(bytes, encoding);
  RosCompressedImage image;
  if (type == kRosCompressedVideo) {
    image.frame_id = reader.time_and_frame();
    image.data = reader.bytes();
    image.format = reader.string();
  } else {
    const bool is_packet = type == kRosFfmpegPacket;
    image.frame_id = reader.header();
    for (int i = 0; is_packet && i < 2; ++i) reader.number<std::uint32_t>();  // Width and height.
    image.format = reader.string();
    if (is_packet) reader.number<std::uint64_t>();                           // Time.
    for (int i = 0; is_packet && i < 2; ++i) reader.number<std::uint8_t>();  // Flags.
    image.data = reader.bytes();
  }
  return reader.is_good() ? std::optional(image) : std::nullopt;
}

std::optional<RosCameraInfo> parse_ros_camera_info(std::string_view bytes, RosEncoding encoding) {
  MessageReader reader(bytes, encoding);
  RosCameraInfo info;
  info.frame_id = reader.header();
  info.height_px = reader.number<std::uint32_t>();
  info.width_px = reader.number<std::uint32_t>();
  info.distortion_model = reader.string();
  info.d = reader.doubles();
  reader.read(info.k);
  reader.read(info.r);
  reader.read(info.p);
  info.binning_x = reader.number<std::uint32_t>();
  info.binning_y = reader.number<std::uint32_t>();
  info.roi_x_px = reader.number<std::uint32_t>();
  info.roi_y_px = reader.number<std::uint32_t>();
  info.roi_height_px = reader.number<std::uint32_t>();
  info.roi_width_px = reader.number<std::uint32_t>();
  return reader.is_good() ? std::optional(info) : std::nullopt;
}

std::optional<RosImu> parse_ros_imu(std::string_view bytes, RosEncoding encoding) {
  MessageReader reader(bytes, encoding);
  RosImu imu;
  reader.header();
  std::array<double, 4> orientation;
  std::array<double, 9> covariance;
  reader.read(orientation);
  reader.read(covariance);
  reader.read(imu.angular_velocity);
  reader.read(covariance);
  imu.has_angular_velocity = covariance[0] != -1.0;
  reader.read(imu.linear_acceleration);
  if (!reader.is_good()) return std::nullopt;
  imu.has_linear_acceleration = reader.number<double>() != -1.0;
  return imu;
}

}  // namespace waymark

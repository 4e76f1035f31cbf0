// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Messages and bags for tests, written from the formats' documentation and not with what reads
// them.

#include <array>
#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

#include "waymark/bag/bag_content.h"
#include "waymark/bag/ros_messages.h"

namespace waymark::testing {

/// A number, least significant byte first.
template <class Number>
std::string little(Number value) {
  std::string bytes;
  std::uint64_t rest = 0;
  if constexpr (std::is_floating_point_v<Number>) {
    rest = std::bit_cast<std::uint64_t>(double{value});
  } else {
    rest = static_cast<std::uint64_t>(value);
  }
  for (std::size_t i = 0; i < sizeof(Number); ++i) {
    bytes += static_cast<char>(rest & 0xFF);
    rest >>= 8;
  }
  return bytes;
}

/// After its length in 32 bits.
inline std::string counted(std::string_view text) {
  return little(static_cast<std::uint32_t>(text.size())) + std::string(text);
}

/// Serialises the fields of a message in their order.
class MessageWriter {
 public:
  explicit MessageWriter(RosEncoding encoding) : is_cdr_(encoding == RosEncoding::kCdr) {
    if (is_cdr_) bytes_ = std::string("\0\1\0\0", 4);
  }

  template <class Number>
  MessageWriter& number(Number value) {
    while (is_cdr_ && (bytes_.size() - 4) % sizeof(Number) != 0) bytes_ += '\0';
    bytes_ += little(value);
    return *this;
  }
  MessageWriter& string(std::string text) {
    if (is_cdr_) text += '\0';
    return sequence(text);
  }
  MessageWriter& sequence(std::string_view data) {
    number(static_cast<std::uint32_t>(data.size()));
    bytes_ += data;
    return *this;
  }
  template <class Numbers>
  MessageWriter& each(const Numbers& values) {
    for (const double value : values) number(value);
    return *this;
  }
  MessageWriter& header(std::int64_t timestamp_ns, const std::string& frame_id) {
    if (!is_cdr_) number(std::uint32_t{7});
    number(static_cast<std::uint32_t>(timestamp_ns / 1'000'000'000));
    number(static_cast<std::uint32_t>(timestamp_ns % 1'000'000'000));
    return string(frame_id);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  bool is_cdr_;
  std::string bytes_;
};

inline std::string write_message(RosEncoding encoding,
                                 std::int64_t timestamp_ns,
                                 const RosImage& image) {
  return MessageWriter(encoding)
      .header(timestamp_ns, image.frame_id)
      .number(image.height_px)
      .number(image.width_px)
      .string(image.encoding)
      .number(static_cast<std::uint8_t>(image.is_bigendian))
      .number(image.step)
      .sequence(image.data)
      .bytes();
}

inline std::string write_message(RosEncoding encoding,
                                 std::int64_t timestamp_ns,
                                 const RosCompressedImage& image) {
  return MessageWriter(encoding)
      .header(timestamp_ns, image.frame_id)
      .string(image.format)
      .sequence(image.data)
      .bytes();
}

inline std::string write_message(RosEncoding encoding,
                                 std::int64_t timestamp_ns,
                                 const RosCameraInfo& info) {
  return MessageWriter(encoding)
      .header(timestamp_ns, info.frame_id)
      .number(info.height_px)
      .number(info.width_px)
      .string(info.distortion_model)
      .number(static_cast<std::uint32_t>(info.d.size()))
      .each(info.d)
      .each(info.k)
      .each(info.r)
      .each(info.p)
      .number(info.binning_x)
      .number(info.binning_y)
      .number(info.roi_x_px)
      .number(info.roi_y_px)
      .number(info.roi_height_px)
      .number(info.roi_width_px)
      .number(std::uint8_t{0})
      .bytes();
}

inline std::string write_message(RosEncoding encoding,
                                 std::int64_t timestamp_ns,
                                 const RosImu& imu) {
  const std::array<double, 9> known = {0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.1};
  const std::array<double, 9> unknown = {-1, 0, 0, 0, 0, 0, 0, 0, 0};
  return MessageWriter(encoding)
      .header(timestamp_ns, "imu_link")
      .each(std::array{0.0, 0.0, 0.0, 1.0})
      .each(unknown)
      .each(imu.angular_velocity)
      .each(imu.has_angular_velocity ? known : unknown)
      .each(imu.linear_acceleration)
      .each(imu.has_linear_acceleration ? known : unknown)
      .bytes();
}

}  // namespace waymark::testing

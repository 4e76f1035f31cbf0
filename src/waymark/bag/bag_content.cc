// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/bag/bag_content.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "waymark/bag/byte_source.h"
#include "waymark/bag/ros_messages.h"
#include "waymark/base/check.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

/// Of 100 000 topics with long names, and of 40 hours of a camera: what is small when it is
/// compressed must not fill the memory.
constexpr std::size_t kMaxNameBytes = std::size_t{1} << 25;
constexpr std::size_t kMaxBagMessages = std::size_t{1} << 22;
/// Five hours at 200 Hz; what comes later is left out.
constexpr std::size_t kMaxBagImuMessages = std::size_t{1} << 22;

/// The time in the std_msgs/Header with which a message begins; 0 where it has none.
std::int64_t header_time_ns(const BagTopic& topic, std::string_view start) {
  const RosEncoding encoding = topic.encoding;
  FieldReader reader(start);
  // ROS 1: the sequence number, which those of Foxglove have not. CDR: how the rest is written.
  if (encoding == RosEncoding::kCdr || topic.type != kRosCompressedVideo) reader.take(4);
  const auto seconds = reader.number<std::uint32_t>();
  const auto nanoseconds = reader.number<std::uint32_t>();
  const bool is_negative = encoding == RosEncoding::kCdr && seconds > INT32_MAX;
  if (reader.has_failed() || is_negative || nanoseconds >= 1'000'000'000) return 0;
  return std::int64_t{seconds} * 1'000'000'000 + nanoseconds;
}

/// "sensor_msgs/msg/Image" is "sensor_msgs/Image".
std::string ros1_type(std::string_view type) {
  constexpr std::string_view kOfRos2 = "/msg/";
  std::string name(type);
  if (const auto at = name.find(kOfRos2); at != std::string::npos) name.replace(at, 5, "/");
  return name;
}

}  // namespace

bool BagTopic::is_listed() const {
  return encoding != RosEncoding::kUnknown &&
         (type == "sensor_msgs/Image" || type == "sensor_msgs/CameraInfo" ||
          type == kRosCompressedImage || type == kRosCompressedVideo || type == kRosFfmpegPacket);
}

bool BagTopic::is_imu() const {
  return encoding != RosEncoding::kUnknown && type == "sensor_msgs/Imu";
}

std::size_t BagTopic::num_start_bytes() const {
  return is_imu() ? kImuStartBytes : kMessageStartBytes;
}

std::uint32_t BagContent::topic_of(std::string_view name,
                                   std::string_view type,
                                   RosEncoding encoding) {
  std::string name_in_ros1 = ros1_type(type);
  const auto next = static_cast<std::uint32_t>(topics.size());
  const auto [at, is_new] =
      topic_by_name_.try_emplace({std::string(name), std::move(name_in_ros1), encoding}, next);
  if (!is_new) return at->second;
  num_name_bytes_ += name.size() + type.size();
  if (num_name_bytes_ > kMaxNameBytes) {
    throw InputError("topic " + quote_for_message(name), "is one of too many, expected a bag");
  }
  topics.push_back({std::string(name), std::get<1>(at->first), encoding, 0});
  return next;
}

void BagContent::add(std::uint32_t topic,
                     std::int64_t recorded_ns,
                     const BagPlace& place,
                     std::string_view start) {
  BagTopic& of = topics.at(topic);
  ++of.num_messages;
  if (!of.is_listed() && !of.is_imu()) return;
  recorded_ns = std::max<std::int64_t>(recorded_ns, 0);
  std::int64_t timestamp_ns = header_time_ns(of, start);
  const bool is_unstamped = timestamp_ns == 0;
  if (is_unstamped) timestamp_ns = recorded_ns;
  if (of.is_imu()) return add_imu({topic, timestamp_ns, recorded_ns, place}, start);
  num_unstamped += is_unstamped;
  if (messages.size() == kMaxBagMessages) {
    throw InputError(
        "topic " + quote_for_message(of.name),
        fmt::format("has too many messages, expected at most {} images in a bag", kMaxBagMessages));
  }
  messages.push_back({topic, timestamp_ns, recorded_ns, place});
}

void BagContent::add_imu(const BagMessage& message, std::string_view start) {
  if (imu.size() == kMaxBagImuMessages) return;
  const auto measured = parse_ros_imu(start, topics[message.topic].encoding);
  if (measured) imu.push_back({message, *measured});
  if (imu.size() < kMaxBagImuMessages) return;
  faults.push_back(fmt::format("inertial data after {} messages are left out", imu.size()));
}

}  // namespace waymark

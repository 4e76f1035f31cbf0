// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/bag/bag_content.h"

#include <algorithm>

#include "waymark/bag/byte_source.h"

namespace waymark {
namespace {

/// The time in the std_msgs/Header with which a message begins; 0 where it has none.
std::int64_t header_time_ns(RosEncoding encoding, std::string_view start) {
  FieldReader reader(start);
  reader.take(4);  // ROS 1: the sequence number. CDR: how the rest is written.
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
         (type == "sensor_msgs/Image" || type == "sensor_msgs/CompressedImage" ||
          type == "sensor_msgs/CameraInfo");
}

std::uint32_t BagContent::topic_of(std::string_view name,
                                   std::string_view type,
                                   RosEncoding encoding) {
  const std::string wanted = ros1_type(type);
  const auto found = std::ranges::find_if(topics, [&](const BagTopic& topic) {
    return topic.name == name && topic.type == wanted && topic.encoding == encoding;
  });
  const auto index = static_cast<std::uint32_t>(found - topics.begin());
  if (found == topics.end()) topics.push_back({std::string(name), wanted, encoding, 0});
  return index;
}

void BagContent::add(std::uint32_t topic,
                     std::int64_t recorded_ns,
                     const BagPlace& place,
                     std::string_view start) {
  BagTopic& of = topics.at(topic);
  ++of.num_messages;
  if (!of.is_listed()) return;
  std::int64_t timestamp_ns = header_time_ns(of.encoding, start);
  if (timestamp_ns == 0) {
    timestamp_ns = std::max<std::int64_t>(recorded_ns, 0);
    ++num_unstamped;
  }
  messages.push_back({topic, timestamp_ns, place});
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "waymark/bag/ros_messages.h"

namespace waymark {

/// How the messages of a topic are written.
enum class RosEncoding {
  kRos1,
  kCdr,      ///< Of ROS 2.
  kUnknown,  ///< Not ROS: is counted, not read.
};

/// A topic of a bag.
struct BagTopic {
  std::string name;
  std::string type;  ///< As ROS 1 writes it, for example "sensor_msgs/Image".
  RosEncoding encoding = RosEncoding::kUnknown;
  std::size_t num_messages = 0;

  /// Whether its messages are listed: images and what tells of cameras. Of others the number.
  bool is_listed() const;
  /// Whether its messages are read while the bag is scanned: those of an IMU are small and many.
  bool is_imu() const;
  /// How many bytes of a message BagContent::add() takes.
  std::size_t num_start_bytes() const;
};

/// Where in a file a message is.
struct BagPlace {
  std::uint32_t file = 0;  ///< Of the files of a bag.
  /// Of the compressed chunks of the file; kNoChunk: it is in the file itself.
  std::uint32_t chunk = UINT32_MAX;
  std::uint64_t offset = 0;  ///< Of its first byte in the chunk, or the row of a data base.
  std::uint64_t size = 0;    ///< Bytes.
};

inline constexpr std::uint32_t kNoChunk = UINT32_MAX;

/// A message, not yet read.
struct BagMessage {
  std::uint32_t topic = 0;  ///< Index into the topics.
  /// Of its header; when it was recorded where the header has none. Not negative.
  std::int64_t timestamp_ns = 0;
  std::int64_t recorded_ns = 0;  ///< When it was recorded. Not negative.
  BagPlace place;
};

/// Bytes of a message that hold its time.
inline constexpr std::size_t kMessageStartBytes = 12;
/// Bytes that hold what an IMU measured, with a name of its frame of up to 200 letters.
inline constexpr std::size_t kImuStartBytes = 512;

/// A message of sensor_msgs/Imu.
struct BagImu {
  BagMessage message;
  RosImu measured;
};

/// What scanning bag files found.
struct BagContent {
  std::vector<BagTopic> topics;      ///< In order of their appearance.
  std::vector<BagMessage> messages;  ///< Of listed topics, in the order of the files.
  std::vector<std::string> faults;   ///< What is damaged or missing, for people.
  std::vector<BagImu> imu;           ///< Of all topics of an IMU, in the order of the files.
  std::size_t num_unstamped = 0;     ///< Listed messages without a time in their header.

  /// The topic of that name and type, new if need be. type: as in ROS 1 or ROS 2. InputError where
  /// all names become longer than those of a bag can be.
  std::uint32_t topic_of(std::string_view name, std::string_view type, RosEncoding encoding);

  /// Counts a message and lists it if its topic is. start: its first bytes, num_start_bytes() of
  /// the topic or fewer.
  void add(std::uint32_t topic,
           std::int64_t recorded_ns,
           const BagPlace& place,
           std::string_view start);

 private:
  void add_imu(const BagMessage& message, std::string_view start);

  std::map<std::tuple<std::string, std::string, RosEncoding>, std::uint32_t> topic_by_name_;
  std::size_t num_name_bytes_ = 0;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/imu_readers.h"

namespace waymark {
namespace {

/// The messages of a topic.
struct ImuTopic {
  std::vector<SensorReading> gyroscope;
  std::vector<SensorReading> accelerometer;
};

std::map<std::uint32_t, ImuTopic> read_topics(
    const BagContent& content, const std::function<std::int64_t(const BagMessage&)>& time_of) {
  std::map<std::uint32_t, ImuTopic> topics;
  for (const BagImu& imu : content.imu) {
    const std::int64_t time_ns = time_of(imu.message);
    const Eigen::Vector3d turn = Eigen::Vector3d::Map(imu.measured.angular_velocity.data());
    const Eigen::Vector3d push = Eigen::Vector3d::Map(imu.measured.linear_acceleration.data());
    if (!turn.allFinite() || !push.allFinite()) continue;
    ImuTopic& topic = topics[imu.message.topic];
    const bool has_turn = imu.measured.has_angular_velocity && !turn.isZero(0.0);
    const bool has_push = imu.measured.has_linear_acceleration && !push.isZero(0.0);
    if (has_turn) topic.gyroscope.push_back({time_ns, turn});
    if (has_push) topic.accelerometer.push_back({time_ns, push});
  }
  return topics;
}

}  // namespace

std::optional<ImuStream> imu_of_bag(const Bag& bag,
                                    const std::function<std::int64_t(const BagMessage&)>& time_of) {
  const BagContent& content = bag.content();
  const auto listed = std::ranges::find_if(content.topics, &BagTopic::is_imu);
  if (listed == content.topics.end()) return std::nullopt;
  const std::map<std::uint32_t, ImuTopic> topics = read_topics(content, time_of);
  const auto with_most = [&](auto size) {
    return std::ranges::max_element(
        topics, {}, [&](const auto& topic) { return size(topic.second); });
  };
  const auto num_turns = [](const ImuTopic& topic) { return topic.gyroscope.size(); };
  const auto num_pushes = [](const ImuTopic& topic) { return topic.accelerometer.size(); };
  const auto num_both = [&](const ImuTopic& topic) {
    return std::min(num_turns(topic), num_pushes(topic));
  };
  auto turns = with_most(num_both), pushes = turns;
  if (turns == topics.end() || num_both(turns->second) < 2) {
    turns = with_most(num_turns);
    pushes = with_most(num_pushes);
  }
  if (turns == topics.end() || num_turns(turns->second) == 0 || num_pushes(pushes->second) == 0) {
    throw InputError(printable(listed->name),
                     "has no turns and accelerations, expected messages of sensor_msgs/Imu with "
                     "both, or two topics");
  }
  const auto name_of = [&](std::uint32_t topic) { return printable(content.topics[topic].name); };
  std::string source = name_of(turns->first);
  if (pushes != turns) source += " and " + name_of(pushes->first);
  ImuStream stream = merge_imu(turns->second.gyroscope, pushes->second.accelerometer, source);
  stream.notes.emplace_back("sensor_msgs/Imu: rad/s, m/s^2");
  for (const auto& [topic, readings] : topics) {
    if (topic == turns->first || topic == pushes->first) continue;
    stream.notes.push_back(fmt::format("note: {} is not used", name_of(topic)));
  }
  return stream;
}

}  // namespace waymark

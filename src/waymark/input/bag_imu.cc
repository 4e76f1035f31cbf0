// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/imu_readers.h"

namespace waymark {
namespace {

/// What the messages of each topic have.
std::map<std::uint32_t, ImuTable> read_topics(
    const BagContent& content, const std::function<std::int64_t(const BagMessage&)>& time_of) {
  std::map<std::uint32_t, ImuTable> topics;
  for (const BagImu& imu : content.imu) {
    const std::int64_t time_ns = time_of(imu.message);
    const Eigen::Vector3d turn = Eigen::Vector3d::Map(imu.measured.angular_velocity.data());
    const Eigen::Vector3d push = Eigen::Vector3d::Map(imu.measured.linear_acceleration.data());
    if (!turn.allFinite() || !push.allFinite()) continue;
    ImuTable& topic = topics[imu.message.topic];
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
  const std::map<std::uint32_t, ImuTable> topics = read_topics(content, time_of);
  // One that has both, if there is any.
  const auto with_most = [&](auto sensor) {
    return std::ranges::max_element(topics, {}, [&](const auto& topic) {
      const ImuTable& of = topic.second;
      return std::pair(std::min(of.gyroscope.size(), of.accelerometer.size()), (of.*sensor).size());
    });
  };
  const auto turns = with_most(&ImuTable::gyroscope), pushes = with_most(&ImuTable::accelerometer);
  if (topics.empty() || turns->second.gyroscope.empty() || pushes->second.accelerometer.empty()) {
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

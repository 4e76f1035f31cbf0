// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/bag_imu.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/imu_merge.h"

namespace waymark {
namespace {

/// The messages of a topic.
struct ImuTopic {
  std::vector<SensorReading> gyroscope;
  std::vector<SensorReading> accelerometer;
  std::vector<ImuSample> samples;  ///< Of messages with both.
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
    if (has_turn && has_push) topic.samples.push_back({time_ns, turn, push});
    if (has_turn) topic.gyroscope.push_back({time_ns, turn});
    if (has_push) topic.accelerometer.push_back({time_ns, push});
  }
  return topics;
}

}  // namespace

std::optional<ImuStream> imu_of_bag(const Bag& bag,
                                    const std::function<std::int64_t(const BagMessage&)>& time_of) {
  const BagContent& content = bag.content();
  std::map<std::uint32_t, ImuTopic> topics = read_topics(content, time_of);
  const auto listed = std::ranges::find_if(content.topics, &BagTopic::is_imu);
  if (listed == content.topics.end()) return std::nullopt;
  const auto fail = [&] {
    throw InputError(printable(listed->name),
                     "has no turns and accelerations, expected messages of sensor_msgs/Imu with "
                     "both, or two topics");
  };
  if (topics.empty()) fail();
  const auto most_of = [&](auto part) {
    return std::ranges::max_element(
        topics, {}, [&](const auto& topic) { return (topic.second.*part).size(); });
  };
  const auto name_of = [&](const auto& topic) {
    return printable(content.topics[topic->first].name);
  };
  ImuStream stream;
  const auto both = most_of(&ImuTopic::samples);
  const auto turns = most_of(&ImuTopic::gyroscope);
  const auto pushes = most_of(&ImuTopic::accelerometer);
  if (both->second.samples.size() >= 2) {
    stream.source = name_of(both);
    stream.samples = std::move(both->second.samples);
  } else {
    if (turns->second.gyroscope.empty() || pushes->second.accelerometer.empty()) fail();
    stream.source = fmt::format("{} and {}", name_of(turns), name_of(pushes));
    stream.samples = merge_imu(turns->second.gyroscope, std::move(pushes->second.accelerometer));
    stream.notes.emplace_back("acceleration interpolated at the times of the gyroscope");
  }
  stream.notes.emplace_back("sensor_msgs/Imu: rad/s, m/s^2");
  for (auto topic = topics.begin(); topic != topics.end(); ++topic) {
    const std::string name = name_of(topic);
    if (stream.source.find(name) != std::string::npos) continue;
    stream.notes.push_back(fmt::format("note: {} is not used", name));
  }
  sort_samples(stream);
  return stream;
}

}  // namespace waymark

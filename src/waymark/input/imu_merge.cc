// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/imu_merge.h"

#include <algorithm>

#include "waymark/base/median.h"

namespace waymark {
namespace {

/// The longest step that is bridged.
std::int64_t longest_step_ns(const std::vector<SensorReading>& readings) {
  constexpr std::int64_t kAlwaysBridgedNs = 50'000'000;
  std::vector<std::int64_t> steps_ns;
  for (std::size_t i = 1; i < readings.size(); ++i) {
    steps_ns.push_back(readings[i].timestamp_ns - readings[i - 1].timestamp_ns);
  }
  const std::int64_t usual_ns = median(steps_ns);
  return std::max(kAlwaysBridgedNs, usual_ns > INT64_MAX / 3 ? INT64_MAX : 3 * usual_ns);
}

}  // namespace

std::vector<ImuSample> merge_imu(const std::vector<SensorReading>& gyroscope,
                                 std::vector<SensorReading> accelerometer) {
  std::vector<ImuSample> samples;
  std::ranges::stable_sort(accelerometer, {}, &SensorReading::timestamp_ns);
  if (accelerometer.size() < 2) return samples;
  const std::int64_t longest_ns = longest_step_ns(accelerometer);
  for (const SensorReading& turn : gyroscope) {
    const auto after = std::ranges::lower_bound(
        accelerometer, turn.timestamp_ns, {}, &SensorReading::timestamp_ns);
    if (after == accelerometer.end()) continue;
    if (after->timestamp_ns == turn.timestamp_ns) {
      samples.push_back({turn.timestamp_ns, turn.value, after->value});
      continue;
    }
    if (after == accelerometer.begin()) continue;
    const SensorReading& before = *(after - 1);
    const std::int64_t step_ns = after->timestamp_ns - before.timestamp_ns;
    if (step_ns > longest_ns) continue;
    const double part =
        static_cast<double>(turn.timestamp_ns - before.timestamp_ns) / static_cast<double>(step_ns);
    samples.push_back(
        {turn.timestamp_ns, turn.value, before.value + part * (after->value - before.value)});
  }
  return samples;
}

}  // namespace waymark

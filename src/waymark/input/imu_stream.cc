// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/imu_stream.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/imu/imu_health.h"
#include "waymark/imu/imu_samples.h"
#include "waymark/input/imu_readers.h"

namespace waymark {
namespace {

double in_seconds(std::int64_t duration_ns) { return 1e-9 * static_cast<double>(duration_ns); }

/// How the samples lie to the images.
std::string describe_overlap(const ImuStream& stream,
                             const std::vector<std::int64_t>& image_times_ns) {
  if (image_times_ns.empty()) return "";
  const auto [first, last] = std::ranges::minmax(image_times_ns);
  const std::int64_t begin = std::max(first, stream.samples.front().timestamp_ns);
  const std::int64_t end = std::min(last, stream.samples.back().timestamp_ns);
  if (begin > end) return "  note: none between the first and the last image: another clock\n";
  if (begin == first && end == last) return "";
  return fmt::format("  note: only {:.3f} s of the images' {:.3f} s have inertial data\n",
                     in_seconds(end - begin),
                     in_seconds(last - first));
}

std::string format_noise(const ImuNoise& noise) {
  return fmt::format(
      "noise of the gyroscope {:.3g} rad/s/sqrt(Hz), of the accelerometer {:.3g} m/s^2/sqrt(Hz)",
      noise.gyroscope,
      noise.accelerometer);
}

std::string format_imu_calibration(const ImuCalibration& calibration) {
  std::string text;
  if (calibration.imu_from_rig) {
    const Eigen::Vector3d place = calibration.imu_from_rig->inverse().translation;
    text += fmt::format("  mounted at [{:.4f}] m from camera 0\n", fmt::join(place, ", "));
  }
  if (calibration.time_shift_s) {
    text += fmt::format("  images are {:.6g} s later by its clock\n", *calibration.time_shift_s);
  }
  if (const auto& noise = calibration.noise) {
    text += fmt::format("  stated: {}; walks {:.3g} rad/s^2/sqrt(Hz) and {:.3g} m/s^3/sqrt(Hz)\n",
                        format_noise(*noise),
                        noise->gyroscope_walk,
                        noise->accelerometer_walk);
  }
  return text;
}

/// Sorts the samples by time, leaves double times out, and counts both.
void sort_samples(ImuStream& stream) {
  std::vector<ImuSample>& samples = stream.samples;
  std::int64_t latest_ns = INT64_MIN;
  for (const ImuSample& sample : samples) {
    stream.num_out_of_order += sample.timestamp_ns < latest_ns;
    latest_ns = std::max(latest_ns, sample.timestamp_ns);
  }
  std::ranges::stable_sort(samples, {}, &ImuSample::timestamp_ns);
  const auto doubles = std::unique(
      samples.begin(), samples.end(), [](const ImuSample& before, const ImuSample& sample) {
        return before.timestamp_ns == sample.timestamp_ns;
      });
  stream.num_doubles += static_cast<std::size_t>(samples.end() - doubles);
  samples.erase(doubles, samples.end());
  if (samples.size() >= 2) return;
  throw InputError(stream.source,
                   fmt::format("has {} of inertial data, expected at least 2 at different times",
                               count_of(samples.size(), "sample")));
}

}  // namespace

ImuStream merge_imu(const std::vector<SensorReading>& gyroscope,
                    std::vector<SensorReading> accelerometer,
                    const std::string& source) {
  ImuStream stream;
  stream.source = source;
  const auto time = &SensorReading::timestamp_ns;
  if (!std::ranges::equal(gyroscope, accelerometer, {}, time, time)) {
    stream.notes.emplace_back("acceleration interpolated at the times of the gyroscope");
  }
  std::ranges::stable_sort(accelerometer, {}, time);
  ImuSamples pushes;
  for (const SensorReading& push : accelerometer) {
    pushes.add({push.timestamp_ns, Eigen::Vector3d::Zero(), push.value});
  }
  for (const SensorReading& turn : gyroscope) {
    const std::optional<ImuSample> at = pushes.at(turn.timestamp_ns);
    if (at) stream.samples.push_back({turn.timestamp_ns, turn.value, at->acceleration});
  }
  sort_samples(stream);
  return stream;
}

std::string fault_of(const ImuStream& stream) {
  if (stream.num_out_of_order > stream.samples.size() / 10) {
    return "so many samples are out of order as those of two devices, or of two clocks, are";
  }
  const ImuHealth health = imu_health(stream.samples);
  if (const double length = health.accelerometer.mean_length; length < 5.0 || length > 30.0) {
    return fmt::format(
        "accelerations have a mean length of {:.3g}, expected gravity in them, 9.8 "
        "m/s^2 or 1 g",
        length);
  }
  if (health.gyroscope.is_constant) return "the gyroscope always shows the same";
  if (health.accelerometer.is_constant) return "the accelerometer always shows the same";
  return {};
}

std::string format_imu(const ImuStream& stream, const std::vector<std::int64_t>& image_times_ns) {
  const ImuHealth health = imu_health(stream.samples);
  std::string text = fmt::format("inertial data: {}\n", stream.source);
  text += fmt::format("  {} over {:.3f} s, {:.1f} per second\n",
                      count_of(stream.samples.size(), "sample"),
                      health.duration_s,
                      health.rate_hz);
  for (const std::string& note : stream.notes) text += fmt::format("  {}\n", note);
  const auto add_count = [&](std::size_t count, const char* what) {
    if (count > 0) text += fmt::format("  note: {} {}\n", count_of(count, "sample"), what);
  };
  add_count(stream.num_out_of_order, "out of order are sorted in");
  add_count(stream.num_doubles, "at the time of another left out");
  text += describe_overlap(stream, image_times_ns);
  text += fmt::format("  gaps: {}\n", health.gaps.size());
  if (!health.gaps.empty()) {
    const ImuGap longest = *std::ranges::max_element(health.gaps, {}, &ImuGap::duration_ns);
    text += fmt::format("    the longest of {:.3f} s at {} s\n",
                        in_seconds(longest.duration_ns),
                        format_seconds(longest.start_ns));
  }
  text += fmt::format(
      "  mean length of the acceleration {:.3f} m/s^2, of the angular velocity {:.3f} rad/s\n",
      health.accelerometer.mean_length,
      health.gyroscope.mean_length);
  if (health.noise) {
    text += fmt::format("  at rest for {:.0f} s: {}\n", health.rest_s, format_noise(*health.noise));
  }
  if (const std::string fault = fault_of(stream); !fault.empty()) {
    text += fmt::format("  note: it is not used: {}\n", fault);
  }
  return text + format_imu_calibration(stream.calibration);
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/imu_stream.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "waymark/base/check.h"
#include "waymark/base/median.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxImuGapsShown = 5;
constexpr std::int64_t kRestPieceNs = 1'000'000'000;
/// Of the slightest motion of a hand more; of the noise of cheap sensors less.
constexpr double kMaxRestGyroscope = 0.01;     // rad/s.
constexpr double kMaxRestAccelerometer = 0.1;  // m/s^2.
constexpr double kMaxRestSpeed = 0.2;          // rad/s, bias included.

double in_seconds(std::int64_t duration_ns) { return 1e-9 * static_cast<double>(duration_ns); }

/// Standard deviation per axis, the root mean square of the three.
double deviation(std::span<const ImuSample> samples, Eigen::Vector3d ImuSample::*value) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : samples) mean += sample.*value;
  mean /= static_cast<double>(samples.size());
  double sum = 0.0;
  for (const ImuSample& sample : samples) sum += (sample.*value - mean).squaredNorm();
  return std::sqrt(sum / (3.0 * static_cast<double>(samples.size() - 1)));
}

/// Looks at the stream a second at a time.
void measure_rest(const std::vector<ImuSample>& samples, ImuStatistics& statistics) {
  constexpr std::size_t kFewest = 10;
  std::vector<double> gyroscope, accelerometer;
  for (auto first = samples.begin(); first != samples.end();) {
    const auto last = std::find_if(first, samples.end(), [&](const ImuSample& sample) {
      return sample.timestamp_ns - first->timestamp_ns >= kRestPieceNs;
    });
    const std::span<const ImuSample> piece(first, last);
    first = last;
    if (piece.size() < kFewest || last == samples.end()) continue;
    const double of_gyroscope = deviation(piece, &ImuSample::angular_velocity);
    const double of_accelerometer = deviation(piece, &ImuSample::acceleration);
    if (of_gyroscope > kMaxRestGyroscope || of_accelerometer > kMaxRestAccelerometer ||
        piece.front().angular_velocity.norm() > kMaxRestSpeed) {
      continue;
    }
    gyroscope.push_back(of_gyroscope);
    accelerometer.push_back(of_accelerometer);
  }
  if (gyroscope.empty()) return;
  statistics.rest_s = static_cast<double>(gyroscope.size()) * in_seconds(kRestPieceNs);
  const double root_of_step = std::sqrt(1.0 / statistics.rate_hz);
  statistics.gyroscope_noise = median(gyroscope) * root_of_step;
  statistics.accelerometer_noise = median(accelerometer) * root_of_step;
}

std::string format_imu_gaps(const std::vector<ImuGap>& gaps) {
  std::string text = gaps.empty() ? "  gaps: none\n" : fmt::format("  gaps: {}\n", gaps.size());
  for (std::size_t i = 0; i < std::min(gaps.size(), kMaxImuGapsShown); ++i) {
    text += fmt::format("    {:.3f} s at {} s\n",
                        in_seconds(gaps[i].duration_ns),
                        format_seconds(gaps[i].start_ns));
  }
  if (gaps.size() > kMaxImuGapsShown) text += "    ...\n";
  return text;
}

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

std::string format_imu_calibration(const ImuCalibration& calibration) {
  std::string text;
  if (calibration.imu_from_rig) {
    const Eigen::Vector3d place = calibration.imu_from_rig->inverse().translation;
    text += fmt::format(
        "  mounted at [{:.4f}, {:.4f}, {:.4f}] m from camera 0\n", place.x(), place.y(), place.z());
  }
  if (calibration.time_shift_s) {
    text += fmt::format("  images are {:.6g} s later by its clock\n", *calibration.time_shift_s);
  }
  if (const auto& noise = calibration.noise) {
    text += fmt::format(
        "  stated noise: gyroscope {:.3g} rad/s/sqrt(Hz), walk {:.3g} rad/s^2/sqrt(Hz); "
        "accelerometer {:.3g} m/s^2/sqrt(Hz), walk {:.3g} m/s^3/sqrt(Hz)\n",
        noise->gyroscope,
        noise->gyroscope_walk,
        noise->accelerometer,
        noise->accelerometer_walk);
  }
  return text;
}

}  // namespace

void sort_samples(ImuStream& stream) {
  std::vector<ImuSample>& samples = stream.samples;
  std::int64_t latest_ns = INT64_MIN;
  for (const ImuSample& sample : samples) {
    stream.num_out_of_order += sample.timestamp_ns < latest_ns;
    latest_ns = std::max(latest_ns, sample.timestamp_ns);
  }
  std::ranges::stable_sort(samples, {}, &ImuSample::timestamp_ns);
  const auto end = std::unique(samples.begin(), samples.end(), [](const auto& a, const auto& b) {
    return a.timestamp_ns == b.timestamp_ns;
  });
  stream.num_doubles += static_cast<std::size_t>(samples.end() - end);
  samples.erase(end, samples.end());
  if (samples.size() >= 2) return;
  throw InputError(stream.source,
                   fmt::format("has {} of inertial data, expected at least 2 at different times",
                               count_of(samples.size(), "sample")));
}

ImuStatistics measure_imu(const ImuStream& stream) {
  const std::vector<ImuSample>& samples = stream.samples;
  WAYMARK_CHECK(samples.size() >= 2);
  std::vector<std::int64_t> steps_ns;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    steps_ns.push_back(samples[i].timestamp_ns - samples[i - 1].timestamp_ns);
  }
  const std::int64_t usual_ns = median(std::vector(steps_ns));
  ImuStatistics statistics;
  statistics.rate_hz = 1.0 / in_seconds(usual_ns);
  statistics.duration_s = in_seconds(samples.back().timestamp_ns - samples.front().timestamp_ns);
  for (std::size_t i = 0; i < steps_ns.size(); ++i) {
    if (static_cast<double>(steps_ns[i]) <= 2.5 * static_cast<double>(usual_ns)) continue;
    statistics.gaps.push_back({samples[i].timestamp_ns, steps_ns[i]});
  }
  for (const ImuSample& sample : samples) {
    statistics.mean_acceleration += sample.acceleration.norm();
    statistics.mean_angular_speed += sample.angular_velocity.norm();
  }
  statistics.mean_acceleration /= static_cast<double>(samples.size());
  statistics.mean_angular_speed /= static_cast<double>(samples.size());
  measure_rest(samples, statistics);
  return statistics;
}

std::string format_imu(const ImuStream& stream, const std::vector<std::int64_t>& image_times_ns) {
  const ImuStatistics statistics = measure_imu(stream);
  std::string text = fmt::format("inertial data: {}\n", stream.source);
  text += fmt::format("  {} over {:.3f} s, {:.1f} per second\n",
                      count_of(stream.samples.size(), "sample"),
                      statistics.duration_s,
                      statistics.rate_hz);
  for (const std::string& note : stream.notes) text += fmt::format("  {}\n", note);
  if (stream.num_out_of_order > 0) {
    const bool are_many = stream.num_out_of_order > stream.samples.size() / 10;
    text += fmt::format("  note: {} out of order are sorted in{}\n",
                        count_of(stream.num_out_of_order, "sample"),
                        are_many ? ": as those of two devices, or of two clocks, are" : "");
  }
  if (stream.num_doubles > 0) {
    text += fmt::format("  note: {} at the time of another left out\n",
                        count_of(stream.num_doubles, "sample"));
  }
  text += describe_overlap(stream, image_times_ns);
  text += format_imu_gaps(statistics.gaps);
  text += fmt::format(
      "  mean length of the acceleration {:.3f} m/s^2, of the angular velocity "
      "{:.3f} rad/s\n",
      statistics.mean_acceleration,
      statistics.mean_angular_speed);
  if (statistics.gyroscope_noise) {
    text += fmt::format(
        "  at rest for {:.0f} s: noise of the gyroscope {:.3g} rad/s/sqrt(Hz), of the "
        "accelerometer {:.3g} m/s^2/sqrt(Hz)\n",
        statistics.rest_s,
        *statistics.gyroscope_noise,
        *statistics.accelerometer_noise);
  }
  return text + format_imu_calibration(stream.calibration);
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What an inertial measurement unit measured beside the images of an input.
//
//   InputOptions options;
//   const InputInfo info = open_input("MH_01_easy", options)->info();
//   if (info.imu) std::cout << format_imu(*info.imu, info.times_ns);

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "waymark/imu/imu.h"

namespace waymark {

/// All that the IMU of a recording measured. Its clock is that of the images, but for
/// ImuCalibration::time_shift_s and where `notes` say otherwise.
struct ImuStream {
  std::vector<ImuSample> samples;  ///< At least two; times increase.
  ImuCalibration calibration;      ///< As far as it is told.
  std::string source;              ///< For people: a file, a topic.
  std::vector<std::string> notes;  ///< What was understood and assumed, for people.
  /// Samples that came later than one with a later time, and were sorted in.
  std::size_t num_out_of_order = 0;
  std::size_t num_doubles = 0;  ///< Samples left out as there is another of their time.
};

/// More samples are refused: more than two hours at 1 kHz.
inline constexpr std::size_t kMaxImuSamples = std::size_t{1} << 23;

/// Sorts the samples by time, leaves double times out, and counts both. Throws InputError at
/// `source` where fewer than two are left.
void sort_samples(ImuStream& stream);

/// Time without samples.
struct ImuGap {
  std::int64_t start_ns = 0;     ///< Time of the sample before it.
  std::int64_t duration_ns = 0;  ///< To the next one.
};

/// Samples in numbers.
struct ImuStatistics {
  double rate_hz = 0.0;             ///< By the middle step from sample to sample.
  double duration_s = 0.0;          ///< From the first to the last sample.
  std::vector<ImuGap> gaps;         ///< Steps of more than 2.5 middle ones.
  double mean_acceleration = 0.0;   ///< Mean length, m/s^2.
  double mean_angular_speed = 0.0;  ///< Mean length, rad/s.
  double rest_s = 0.0;              ///< How long the IMU was at rest, in pieces of a second.
  /// White noise of a sample at rest (its standard deviation times the root of the step), per
  /// axis; nothing where it was never at rest.
  std::optional<double> gyroscope_noise;      ///< rad/s/sqrt(Hz).
  std::optional<double> accelerometer_noise;  ///< m/s^2/sqrt(Hz).
};

/// Of a stream with at least two samples.
ImuStatistics measure_imu(const ImuStream& stream);

/// What the stream holds, a line each; image_times_ns: of the images beside it, if known.
std::string format_imu(const ImuStream& stream, const std::vector<std::int64_t>& image_times_ns);

}  // namespace waymark

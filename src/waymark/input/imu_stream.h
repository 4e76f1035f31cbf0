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

/// Why what it measured cannot be used, for people; empty where it can.
std::string fault_of(const ImuStream& stream);

/// What the stream holds, a line each; image_times_ns: of the images beside it, if known.
std::string format_imu(const ImuStream& stream, const std::vector<std::int64_t>& image_times_ns);

}  // namespace waymark

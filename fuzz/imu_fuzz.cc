// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// The readers of inertial data. The first byte of the input says which: g, a payload of GPMF; else
// a table, of a gyroscope, an accelerometer or both by its name.
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/input/gopro_imu.h"
#include "waymark/input/imu_table.h"

namespace {

using namespace waymark;

void check(const ImuStream& stream) {
  for (std::size_t i = 1; i < stream.samples.size(); ++i) {
    WAYMARK_CHECK(stream.samples[i - 1].timestamp_ns < stream.samples[i].timestamp_ns);
  }
  format_imu(stream, {0, 1'000'000'000});
}

void read_telemetry_twice(const std::string& payload) {
  const std::vector<TelemetryPacket> packets = {{0.0, 1.0, payload}, {1.0, 0.5, payload}};
  if (const auto stream = imu_of_gopro(packets, "fuzz")) check(*stream);
}

void read_table(const std::string& text, const std::string& name) {
  ImuTable table = parse_imu_table(text, name);
  check(merge_imu(table.gyroscope, std::move(table.accelerometer), name));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  constexpr std::array kNames = {"imu.csv", "gyro.csv", "accel.csv"};
  const std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    if (data[0] == 'g') {
      read_telemetry_twice(text);
    } else {
      read_table(text, kNames[data[0] % kNames.size()]);
    }
  } catch (const InputError& error) {
    WAYMARK_CHECK(std::string_view(error.what()).find("\n") == std::string_view::npos);
  }
  return 0;
}

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace waymark {

/// Measurements of one kind, in one payload of GPMF, the telemetry of GoPro cameras.
struct GpmfStream {
  std::string key;             ///< "ACCL", "GYRO", "GRAV", "IORI", ...
  std::string device;          ///< The model (DVNM).
  std::size_t num_values = 1;  ///< Of a sample.
  std::vector<double> values;  ///< Scaled (SCAL), sample after sample.
  /// Which axis each value is of, "XzY": small letters point against it (ORIN); empty: not told.
  std::string axes;
  std::optional<std::uint64_t> num_total;  ///< Samples up to the end of the payload (TSMP).

  std::size_t num_samples() const { return values.size() / num_values; }
};

/// Parses a payload: the last element of each STRM, if it is of numbers of 16 or 32 bits, with what
/// the elements before say of it. What is cut off or malformed ends it: what came before is given.
std::vector<GpmfStream> parse_gpmf(std::string_view payload);

}  // namespace waymark

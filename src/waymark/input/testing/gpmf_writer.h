// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace waymark::testing {

/// A number of so many bytes, most significant first.
inline std::string big(std::int64_t value, int num_bytes) {
  std::string bytes;
  for (int i = num_bytes - 1; i >= 0; --i) bytes += static_cast<char>(value >> (8 * i));
  return bytes;
}

/// An element of GPMF; type 0 holds others.
inline std::string gpmf_element(const std::string& key,
                                char type,
                                int sample_size,
                                const std::string& data) {
  const auto count = static_cast<std::int64_t>(data.size()) / sample_size;
  std::string bytes = key + type + static_cast<char>(sample_size) + big(count, 2) + data;
  while (bytes.size() % 4 != 0) bytes += '\0';
  return bytes;
}

/// Samples of 16 bits.
inline std::string gpmf_shorts(const std::string& key,
                               int per_sample,
                               const std::vector<int>& values) {
  std::string data;
  for (const int value : values) data += big(value, 2);
  return gpmf_element(key, 's', 2 * per_sample, data);
}

/// A payload of a camera with these streams, each the elements of a STRM.
inline std::string gpmf_payload(const std::vector<std::string>& streams) {
  std::string content = gpmf_element("DVNM", 'c', 1, "Made Up");
  for (const std::string& stream : streams) content += gpmf_element("STRM", '\0', 4, stream);
  return gpmf_element("DEVC", '\0', 4, content);
}

/// So many samples of gyroscope (1, 2, 3 rad/s by its channels) and accelerometer (9.8, 0, 0).
inline std::string gpmf_imu_payload(int count, int num_before, const std::string& more = {}) {
  std::vector<int> turns, pushes;
  for (int i = 0; i < count; ++i) {
    turns.insert(turns.end(), {100, 200, 300});
    pushes.insert(pushes.end(), {980, 0, 0});
  }
  const std::string head = gpmf_element("TSMP", 'L', 4, big(num_before + count, 4)) + more +
                           gpmf_shorts("SCAL", 1, {100});
  return gpmf_payload(
      {head + gpmf_shorts("ACCL", 3, pushes), head + gpmf_shorts("GYRO", 3, turns)});
}

}  // namespace waymark::testing

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <msgpack.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/crc32.h"

namespace waymark::testing {

/// Makes the checksum at the end of a record right after an edit.
inline void seal_record(std::string& record) {
  constexpr std::size_t kTypeAndValue = 5;
  if (record.size() < kTypeAndValue) return;
  const std::size_t end = record.size() - kTypeAndValue;
  const std::uint32_t checksum = crc32c(std::string_view(record).substr(0, end));
  for (std::size_t i = 0; i < 4; ++i) {
    record[end + 1 + i] = static_cast<char>(checksum >> (24 - 8 * i) & 0xFF);
  }
}

/// The records of a map file, and as the last one what is none, if there is any such bytes.
inline std::vector<std::string> split_records(std::string_view bytes) {
  std::vector<std::string> records;
  const msgpack::unpack_limit limit(64, 64, 1u << 20, 1u << 26, 0, 8);
  std::size_t begin = 0;
  try {
    while (begin < bytes.size()) {
      std::size_t end = begin;
      msgpack::unpack(bytes.data(), bytes.size(), end, nullptr, nullptr, limit);
      records.emplace_back(bytes.substr(begin, end - begin));
      begin = end;
    }
  } catch (const msgpack::unpack_error&) {
    records.emplace_back(bytes.substr(begin));
  }
  return records;
}

inline std::string join_records(const std::vector<std::string>& records) {
  std::string bytes;
  for (const std::string& record : records) bytes += record;
  return bytes;
}

}  // namespace waymark::testing

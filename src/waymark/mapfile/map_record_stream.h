// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <istream>
#include <string>
#include <string_view>

#include "waymark/mapfile/map_record.h"

namespace waymark {

/// Reads the records of a map file one after the other and checks their checksums. Holds one record
/// at a time; nothing that a record claims is allocated before its bytes are there. The stream is
/// borrowed.
class MapRecordStream {
 public:
  /// `name` is what errors call the file.
  MapRecordStream(std::istream& stream, std::string name);

  /// The next record, which lives until the next call. InputError at the end of the file.
  MapRecord next();
  /// Of all records so far: the CRC-32C of their checksums.
  std::uint32_t checksum() const { return checksum_; }
  /// Whether the file ends here.
  bool is_at_end();
  /// The kind of the last record; empty for the header, which has none.
  const std::string& kind() const { return kind_; }

 private:
  bool read_more();
  bool measure(std::size_t& end) const;
  std::string_view read_next();
  void check_checksum(std::string_view record);
  std::string where() const;
  std::string place() const;

  std::istream& stream_;
  std::string name_;
  std::string buffer_;
  std::size_t begin_ = 0;        // Of what was not unpacked yet.
  std::uint64_t num_bytes_ = 0;  // Of the file before the buffer.
  std::uint64_t num_records_ = 0;
  std::uint32_t checksum_ = 0;
  std::string kind_;
  std::uint64_t id_ = 0;  // 0 where it has none.
};

}  // namespace waymark

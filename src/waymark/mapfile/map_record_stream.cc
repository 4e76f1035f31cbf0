// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/map_record_stream.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/crc32.h"
#include "waymark/base/text.h"
#include "waymark/mapfile/map_layout.h"

namespace waymark {
namespace {

constexpr std::size_t kChunkBytes = std::size_t{64} << 10;
constexpr std::size_t kMaxKeys = 64;
constexpr std::size_t kMaxDepth = 4;

using Kind = MsgpackValue::Kind;

/// The value of a key of a map that is whole; of no kind if there is none.
MsgpackValue find_value(std::string_view record, std::string_view key) {
  std::size_t at = 0;
  MsgpackValue map, found, value;
  read_msgpack(record, at, map);
  for (std::size_t i = 0; map.kind == Kind::kMap && i < map.size; ++i) {
    std::size_t value_at = at;
    skip_msgpack(record, value_at);
    const bool is_found =
        read_msgpack(record, at, value) && value.kind == Kind::kText && value.bytes == key;
    at = value_at;
    if (is_found && read_msgpack(record, value_at, found)) return found;
    skip_msgpack(record, at);
  }
  return {};
}

}  // namespace

MapRecordStream::MapRecordStream(std::istream& stream, std::string name)
    : stream_(stream), name_(std::move(name)) {}

MapRecord MapRecordStream::next() {
  kind_.clear();
  id_ = 0;
  const std::string_view record = read_next();
  if (const MsgpackValue kind = find_value(record, "kind"); kind.kind == Kind::kText) {
    kind_ = kind.bytes;
  }
  id_ = find_value(record, "id").whole;
  return MapRecord(record, where());
}

bool MapRecordStream::is_at_end() { return begin_ == buffer_.size() && !read_more(); }

std::string MapRecordStream::where() const {
  if (kind_.empty()) return fmt::format("{}: record {}", name_, num_records_);
  const std::string kind = quote_for_message(kind_);
  return fmt::format("{}: {} {}", name_, std::string_view(kind).substr(1, kind.size() - 2), id_);
}

std::string MapRecordStream::place() const {
  return fmt::format("{}: record {} at byte {}", name_, num_records_, num_bytes_ + begin_);
}

/// Adds at least a chunk to the buffer, twice what it has for large records.
bool MapRecordStream::read_more() {
  num_bytes_ += begin_;
  buffer_.erase(0, begin_);
  begin_ = 0;
  const std::size_t old_size = buffer_.size();
  buffer_.resize(old_size + std::max(kChunkBytes, old_size));
  stream_.read(buffer_.data() + old_size, static_cast<std::streamsize>(buffer_.size() - old_size));
  buffer_.resize(old_size + static_cast<std::size_t>(stream_.gcount()));
  if (stream_.bad()) throw InputError(name_, "cannot be read, expected a map file");
  return buffer_.size() > old_size;
}

/// Finds the end of the record at begin_; false where the buffer ends before. What is too large is
/// refused by its first bytes.
bool MapRecordStream::measure(std::size_t& end) const {
  std::array<std::size_t, kMaxDepth> num_left;
  std::size_t depth = 0;
  MsgpackValue value;
  end = begin_;
  do {
    const bool is_whole = read_msgpack(buffer_, end, value);
    const bool is_nest = value.kind == Kind::kArray || value.kind == Kind::kMap;
    if ((is_nest && (value.size > kMaxKeys || depth == kMaxDepth)) ||
        (value.kind == Kind::kText && value.size > kMaxTextBytes) ||
        (value.kind == Kind::kBytes && value.size > kMaxArrayBytes)) {
      throw InputError(place(), "is too large or too deep, expected less");
    }
    if (!is_whole) return false;
    if (value.kind == Kind::kNone || value.kind == Kind::kExtension) {
      throw InputError(place(), "is damaged, expected MessagePack data");
    }
    if (is_nest && value.size > 0) {
      num_left[depth++] = value.kind == Kind::kMap ? 2 * value.size : value.size;
    } else {
      while (depth > 0 && --num_left[depth - 1] == 0) --depth;
    }
  } while (depth > 0);
  return true;
}

std::string_view MapRecordStream::read_next() {
  std::size_t end = begin_;
  while (!measure(end)) {
    if (buffer_.size() - begin_ > kMaxRecordBytes) {
      throw InputError(place(),
                       fmt::format("is larger than {} MB, expected less", kMaxRecordBytes >> 20));
    }
    if (!read_more())
      throw InputError(place(), "is truncated, expected records up to one of the kind end");
  }
  const std::string_view record = std::string_view(buffer_).substr(begin_, end - begin_);
  check_checksum(record);
  begin_ = end;
  ++num_records_;
  return record;
}

void MapRecordStream::check_checksum(std::string_view record) {
  if (num_records_ == 0 && find_value(record, "format").kind == Kind::kNone) {
    throw InputError(name_, "is no map file, expected one written by waymark");
  }
  constexpr std::string_view kLastKey = "crc32c\xce";  // And the type of what follows.
  constexpr std::size_t kChecksumBytes = 5;
  const std::size_t size = record.size() - std::min(record.size(), kChecksumBytes);
  const MsgpackValue stated = find_value(record, "crc32c");
  if (stated.kind != Kind::kUnsigned || !record.substr(0, size + 1).ends_with(kLastKey))
    throw InputError(place(),
                     "does not end with its checksum, expected crc32c as its last key, of 32 bits");
  const std::uint32_t computed = crc32c(record.substr(0, size));
  if (computed != stated.whole) {
    throw InputError(
        place(),
        fmt::format("is damaged: its checksum is {:08x}, expected {:08x}", computed, stated.whole));
  }
  checksum_ = crc32c(record.substr(size + 1), checksum_);
}

}  // namespace waymark

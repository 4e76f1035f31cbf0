// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/map_record_stream.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/mapfile/crc32c.h"
#include "waymark/mapfile/map_limits.h"

namespace waymark {
namespace {

constexpr std::size_t kChunkBytes = std::size_t{64} << 10;
constexpr std::size_t kMaxKeys = 64;
constexpr std::size_t kMaxDepth = 4;
constexpr std::size_t kChecksumBytes = 5;  // Its type and its value, always of four bytes.

/// Data stays in the buffer.
bool refer_to_buffer(msgpack::type::object_type, std::size_t, void*) { return true; }

const msgpack::object* find_value(const msgpack::object& map, std::string_view key) {
  if (map.type != msgpack::type::MAP) return nullptr;
  for (std::uint32_t i = 0; i < map.via.map.size; ++i) {
    const msgpack::object_kv& entry = map.via.map.ptr[i];
    if (entry.key.type != msgpack::type::STR) continue;
    if (std::string_view(entry.key.via.str.ptr, entry.key.via.str.size) == key) return &entry.val;
  }
  return nullptr;
}

}  // namespace

MapRecordStream::MapRecordStream(std::istream& stream, std::string name)
    : stream_(stream), name_(std::move(name)) {}

MapRecord MapRecordStream::next() {
  kind_.clear();
  id_ = 0;
  const msgpack::object object = unpack_next();
  if (const msgpack::object* kind = find_value(object, "kind")) {
    if (kind->type == msgpack::type::STR) kind_.assign(kind->via.str.ptr, kind->via.str.size);
  }
  if (const msgpack::object* id = find_value(object, "id")) {
    if (id->type == msgpack::type::POSITIVE_INTEGER) id_ = id->via.u64;
  }
  return MapRecord(object, where());
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

msgpack::object MapRecordStream::unpack_next() {
  const msgpack::unpack_limit limit(
      kMaxKeys, kMaxKeys, kMaxTextBytes, kMaxArrayBytes, 0, kMaxDepth);
  while (true) {
    zone_.clear();
    std::size_t end = begin_;
    try {
      const msgpack::object object = msgpack::unpack(
          zone_, buffer_.data(), buffer_.size(), end, refer_to_buffer, nullptr, limit);
      const auto bytes = std::string_view(buffer_).substr(begin_, end - begin_);
      check_checksum(object, bytes);
      begin_ = end;
      ++num_records_;
      return object;
    } catch (const msgpack::insufficient_bytes&) {
      if (buffer_.size() - begin_ > kMaxRecordBytes) {
        throw InputError(place(),
                         fmt::format("is larger than {} MB, expected less", kMaxRecordBytes >> 20));
      }
    } catch (const msgpack::size_overflow& error) {
      throw InputError(place(),
                       fmt::format("is too large or too deep ({}), expected less", error.what()));
    } catch (const msgpack::unpack_error&) {
      throw InputError(place(), "is damaged, expected MessagePack data");
    }
    if (!read_more())
      throw InputError(place(), "is truncated, expected records up to one of the kind end");
  }
}

void MapRecordStream::check_checksum(const msgpack::object& object, std::string_view bytes) const {
  if (num_records_ == 0 && !find_value(object, "format")) {
    throw InputError(name_, "is no map file, expected one written by waymark");
  }
  const msgpack::object* stated = find_value(object, "crc32c");
  const msgpack::object_kv* last = stated ? object.via.map.ptr + object.via.map.size - 1 : nullptr;
  const bool is_in_place = stated && stated == &last->val &&
                           stated->type == msgpack::type::POSITIVE_INTEGER &&
                           bytes[bytes.size() - kChecksumBytes] == '\xce';
  if (!is_in_place)
    throw InputError(place(),
                     "does not end with its checksum, expected crc32c as its last key, of 32 bits");
  const std::uint32_t computed = crc32c(bytes.substr(0, bytes.size() - kChecksumBytes));
  if (computed != stated->via.u64) {
    throw InputError(
        place(),
        fmt::format(
            "is damaged: its checksum is {:08x}, expected {:08x}", computed, stated->via.u64));
  }
}

}  // namespace waymark

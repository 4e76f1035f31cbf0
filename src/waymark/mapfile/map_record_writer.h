// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "waymark/geometry/rigid3.h"
#include "waymark/mapfile/map_layout.h"
#include "waymark/mapfile/msgpack.h"

namespace waymark {

/// Writes the records of a map file one after the other, each a MessagePack map that ends with its
/// checksum. Holds one record at a time. Numbers that readers would refuse are an OutputError.
class MapRecordWriter {
 public:
  /// Takes the bytes of the file one after the other.
  using Write = std::function<void(std::string_view bytes)>;

  /// `name` begins error messages: the file.
  MapRecordWriter(Write write, std::string name)
      : write_(std::move(write)), name_(std::move(name)) {}

  /// The first record of a map, which has no kind.
  void write_header(int version, std::string_view producer);
  /// The first record of a journal of changes to the map file of that checksum.
  void write_journal_header(int version, std::string_view producer, std::uint32_t map_checksum);

  void begin(std::string_view kind, std::uint64_t id);
  void add(std::string_view key, std::uint64_t value) { pack_unsigned(add_key(key), value); }
  void add_signed(std::string_view key, std::int64_t value) { pack_signed(add_key(key), value); }
  void add_flag(std::string_view key, bool value) { pack_flag(add_key(key), value); }
  void add_text(std::string_view key, std::string_view value) { pack_text(add_key(key), value); }
  void add_bytes(std::string_view key, std::string_view value) { pack_bytes(add_key(key), value); }
  void add_number(std::string_view key, double value, const NumberRange& range);
  void add_numbers(std::string_view key, std::span<const double> values) {
    pack_numbers(add_key(key), values);
  }
  void add_transform(std::string_view key, const Rigid3& transform);
  /// nil where the id is invalid.
  template <class Tag>
  void add_id(std::string_view key, Id<Tag> id) {
    id.is_valid() ? add(key, id.value) : pack_nil(add_key(key));
  }
  template <class Array>
  void add_array(std::string_view key, const Array& values, const NumberRange& range = {}) {
    using T = typename Array::value_type;
    if (const auto bad = find_outside(values, range)) fail(key, bad->number);
    add_raw_array(key,
                  map_array_layout<T>(),
                  values.size(),
                  {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)});
  }
  void end();

  /// The last record, of a map or of a change: how many there are of each kind.
  void write_counts();

  /// Of all records so far: the CRC-32C of their checksums.
  std::uint32_t checksum() const { return checksum_; }

  /// OutputError: what the current record would hold cannot be read again.
  [[noreturn]] void fail(const std::string& what) const;

 private:
  /// Begins a value; what it is goes to the bytes that come back.
  std::string& add_key(std::string_view key);
  [[noreturn]] void fail(std::string_view key, double value) const;
  void add_raw_array(std::string_view key,
                     const MapArrayLayout& layout,
                     std::size_t count,
                     std::string_view bytes);

  const Write write_;
  const std::string name_;
  std::string record_;  // For errors: its kind and id.
  std::string body_;
  std::uint32_t num_keys_ = 0;
  std::uint32_t checksum_ = 0;
  std::map<std::string, std::uint64_t, std::less<>> counts_;
};

}  // namespace waymark

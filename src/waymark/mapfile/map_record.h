// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "waymark/geometry/rigid3.h"
#include "waymark/mapfile/map_layout.h"
#include "waymark/mapfile/msgpack.h"

namespace waymark {

/// A value with the bytes of what is in it.
struct MsgpackElement : MsgpackValue {
  std::string_view content;  ///< Of an array or map.
};

/// One map of a map file, its values by key. Each value is asked for once, with what it may be;
/// whatever else it is fails with an InputError that says so. Borrows the bytes.
class MapRecord {
 public:
  /// `where` begins error messages: the file and which record it is.
  MapRecord(std::string_view bytes, std::string where);

  const std::string& where() const { return where_; }
  [[noreturn]] void fail(const std::string& what) const;

  bool has(std::string_view key) const;
  std::uint64_t whole(std::string_view key, std::uint64_t max);
  std::int64_t signed_whole(std::string_view key);
  bool flag(std::string_view key);
  std::string text(std::string_view key, std::size_t max_bytes);
  std::string bytes(std::string_view key);
  double number(std::string_view key, const NumberRange& range);
  std::vector<double> numbers(std::string_view key, std::size_t max_count);
  Rigid3 transform(std::string_view key);
  std::vector<std::pair<std::string, std::uint64_t>> counts(std::string_view key);
  /// An id below `end`, or an invalid one where the file has nil.
  template <class IdType>
  IdType id(std::string_view key, std::uint64_t end);
  /// An array; of `count` elements if that is given. Numbers are finite and within the range.
  template <class T, class Array = std::vector<T>>
  Array array(std::string_view key,
              std::optional<std::size_t> count,
              const NumberRange& range = {});

  /// An array of 1 to max_count ids that ascend, above `last`, which becomes the last of them, and
  /// below `end`.
  template <class IdType>
  std::vector<IdType> ascending_ids(std::string_view key,
                                    std::size_t max_count,
                                    IdType end,
                                    IdType& last);

  /// Fails if there is anything that was not asked for.
  void expect_no_more() const;

 private:
  struct Entry {
    std::string_view key;
    MsgpackElement value;
    bool is_used = false;
  };

  const MsgpackElement& take(std::string_view key);
  [[noreturn]] void fail_value(std::string_view key,
                               const MsgpackValue& value,
                               const std::string& expected) const;
  std::vector<double> finite_list(std::string_view key,
                                  const MsgpackElement& value,
                                  std::size_t max_count) const;
  bool is_nil(std::string_view key) const;
  std::string_view array_bytes(std::string_view key,
                               const MapArrayLayout& layout,
                               std::optional<std::size_t> count);
  [[noreturn]] void fail_element(std::string_view key, std::size_t index, double value) const;

  std::string where_;
  std::vector<Entry> entries_;
};

template <class IdType>
IdType MapRecord::id(std::string_view key, std::uint64_t end) {
  if (is_nil(key)) {
    take(key);
    return {};
  }
  if (end == 0) fail(std::string(key) + " is given, expected nil, for there are none");
  return IdType{static_cast<std::uint32_t>(whole(key, end - 1))};
}

template <class T, class Array>
Array MapRecord::array(std::string_view key,
                       std::optional<std::size_t> count,
                       const NumberRange& range) {
  const std::string_view bytes = array_bytes(key, map_array_layout<T>(), count);
  Array values(bytes.size() / sizeof(T));
  if (!bytes.empty()) std::memcpy(static_cast<void*>(values.data()), bytes.data(), bytes.size());
  if (const auto bad = find_outside(values, range)) fail_element(key, bad->index, bad->number);
  return values;
}

template <class IdType>
std::vector<IdType> MapRecord::ascending_ids(std::string_view key,
                                             std::size_t max_count,
                                             IdType end,
                                             IdType& last) {
  const auto ids = array<IdType>(key, std::nullopt);
  if (ids.empty() || ids.size() > max_count) {
    fail(fmt::format("has {} {}s, expected 1 to {}", ids.size(), key, max_count));
  }
  for (const IdType id : ids) {
    if (id >= end || (last.is_valid() && id <= last)) {
      fail(fmt::format("has {} {} after {}, expected ids that ascend below {}",
                       key,
                       id.value,
                       last.is_valid() ? fmt::format("{}", last.value) : "none",
                       end.value));
    }
    last = id;
  }
  return ids;
}

}  // namespace waymark

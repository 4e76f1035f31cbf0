// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/map_record.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/mapfile/map_limits.h"

namespace waymark {
namespace {

constexpr double kMaxNormError = 1e-6;

std::string_view view(const msgpack::object& text) { return {text.via.str.ptr, text.via.str.size}; }

/// The value in words, short whatever it is.
std::string describe(const msgpack::object& value) {
  switch (value.type) {
    case msgpack::type::NIL:
      return "nil";
    case msgpack::type::BOOLEAN:
      return value.via.boolean ? "true" : "false";
    case msgpack::type::POSITIVE_INTEGER:
      return fmt::format("{}", value.via.u64);
    case msgpack::type::NEGATIVE_INTEGER:
      return fmt::format("{}", value.via.i64);
    case msgpack::type::FLOAT32:
    case msgpack::type::FLOAT64:
      return fmt::format("{}", value.via.f64);
    case msgpack::type::STR:
      return quote_for_message(view(value));
    case msgpack::type::BIN:
      return fmt::format("{} bytes", value.via.bin.size);
    case msgpack::type::ARRAY:
      return fmt::format("a list of {}", value.via.array.size);
    case msgpack::type::MAP:
      return fmt::format("a map of {} keys", value.via.map.size);
    default:
      return "an extension";
  }
}

const msgpack::object* find_in(const msgpack::object& map, std::string_view key) {
  for (std::uint32_t i = 0; i < map.via.map.size; ++i) {
    const msgpack::object_kv& entry = map.via.map.ptr[i];
    if (entry.key.type == msgpack::type::STR && view(entry.key) == key) return &entry.val;
  }
  return nullptr;
}

/// Whether a value is a map of exactly these keys.
bool is_map_of(const msgpack::object& value, std::initializer_list<std::string_view> keys) {
  if (value.type != msgpack::type::MAP || value.via.map.size != keys.size()) return false;
  return std::all_of(
      keys.begin(), keys.end(), [&](std::string_view key) { return find_in(value, key); });
}

/// The elements of a shape, or nothing where it has other rows than the layout.
std::optional<std::size_t> count_elements(const msgpack::object& shape,
                                          const MapArrayLayout& layout) {
  if (shape.type != msgpack::type::ARRAY) return std::nullopt;
  if (shape.via.array.size != 1 + layout.element_shape.size()) return std::nullopt;
  const msgpack::object* sizes = shape.via.array.ptr;
  for (std::size_t i = 0; i < shape.via.array.size; ++i) {
    if (sizes[i].type != msgpack::type::POSITIVE_INTEGER) return std::nullopt;
    if (i > 0 && sizes[i].via.u64 != layout.element_shape[i - 1]) return std::nullopt;
  }
  if (sizes[0].via.u64 > kMaxArrayBytes) return std::nullopt;
  return static_cast<std::size_t>(sizes[0].via.u64);
}

}  // namespace

MapRecord::MapRecord(const msgpack::object& object, std::string where) : where_(std::move(where)) {
  if (object.type != msgpack::type::MAP) {
    fail(fmt::format("is {}, expected a map of keys and values", describe(object)));
  }
  for (std::uint32_t i = 0; i < object.via.map.size; ++i) {
    const msgpack::object_kv& entry = object.via.map.ptr[i];
    if (entry.key.type != msgpack::type::STR) {
      fail(fmt::format("has the key {}, expected text", describe(entry.key)));
    }
    if (has(view(entry.key))) {
      fail(fmt::format("has the key {} twice, expected each once", describe(entry.key)));
    }
    Entry added;
    added.key = view(entry.key);
    added.value = &entry.val;
    entries_.push_back(added);
  }
}

void MapRecord::fail(const std::string& what) const { throw InputError(where_, what); }

const msgpack::object* MapRecord::find(std::string_view key) const {
  for (const Entry& entry : entries_) {
    if (entry.key == key) return entry.value;
  }
  return nullptr;
}

const msgpack::object& MapRecord::take(std::string_view key) {
  for (Entry& entry : entries_) {
    if (entry.key != key) continue;
    WAYMARK_CHECK(!entry.is_used);
    entry.is_used = true;
    return *entry.value;
  }
  fail(fmt::format("has no {}, expected one", key));
}

void MapRecord::fail_value(std::string_view key,
                           const msgpack::object& value,
                           const std::string& expected) const {
  fail(fmt::format("{} is {}, expected {}", key, describe(value), expected));
}

void MapRecord::fail_element(std::string_view key, std::size_t index, double value) const {
  fail(fmt::format(
      "{} holds {} as number {}, expected one that is finite and possible", key, value, index));
}

std::uint64_t MapRecord::whole(std::string_view key, std::uint64_t max) {
  const msgpack::object& value = take(key);
  if (value.type != msgpack::type::POSITIVE_INTEGER || value.via.u64 > max) {
    fail_value(key, value, fmt::format("a whole number from 0 to {}", max));
  }
  return value.via.u64;
}

std::int64_t MapRecord::signed_whole(std::string_view key) {
  const msgpack::object& value = take(key);
  constexpr auto kMax = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  if (value.type == msgpack::type::NEGATIVE_INTEGER) return value.via.i64;
  if (value.type != msgpack::type::POSITIVE_INTEGER || value.via.u64 > kMax) {
    fail_value(key, value, "a whole number of 64 bits");
  }
  return static_cast<std::int64_t>(value.via.u64);
}

bool MapRecord::flag(std::string_view key) {
  const msgpack::object& value = take(key);
  if (value.type != msgpack::type::BOOLEAN) fail_value(key, value, "true or false");
  return value.via.boolean;
}

std::string MapRecord::text(std::string_view key, std::size_t max_bytes) {
  const msgpack::object& value = take(key);
  if (value.type != msgpack::type::STR || value.via.str.size > max_bytes) {
    fail_value(key, value, fmt::format("text of at most {} bytes", max_bytes));
  }
  return std::string(view(value));
}

std::string MapRecord::bytes(std::string_view key) {
  const msgpack::object& value = take(key);
  if (value.type != msgpack::type::BIN || value.via.bin.size > kMaxArrayBytes) {
    fail_value(key, value, fmt::format("binary data of at most {} bytes", kMaxArrayBytes));
  }
  return std::string(value.via.bin.ptr, value.via.bin.size);
}

double MapRecord::number(std::string_view key, const NumberRange& range) {
  const msgpack::object& value = take(key);
  const bool is_number = value.type == msgpack::type::FLOAT64;
  if (!is_number || !(value.via.f64 >= range.low && value.via.f64 <= range.high)) {
    fail_value(key, value, fmt::format("a number from {} to {}", range.low, range.high));
  }
  return value.via.f64;
}

std::vector<double> MapRecord::numbers(std::string_view key, std::size_t max_count) {
  return finite_list(key, take(key), max_count);
}

std::vector<double> MapRecord::finite_list(std::string_view key,
                                           const msgpack::object& value,
                                           std::size_t max_count) const {
  if (value.type != msgpack::type::ARRAY || value.via.array.size > max_count) {
    fail_value(key, value, fmt::format("a list of at most {} numbers", max_count));
  }
  std::vector<double> numbers;
  for (std::uint32_t i = 0; i < value.via.array.size; ++i) {
    const msgpack::object& element = value.via.array.ptr[i];
    if (element.type != msgpack::type::FLOAT64 || !std::isfinite(element.via.f64)) {
      fail_value(key, element, "finite numbers");
    }
    numbers.push_back(element.via.f64);
  }
  return numbers;
}

Rigid3 MapRecord::transform(std::string_view key) {
  const msgpack::object& value = take(key);
  if (!is_map_of(value, {"rotation", "translation"})) {
    fail_value(key, value, "a map of rotation and translation");
  }
  const std::vector<double> rotation = finite_list(key, *find_in(value, "rotation"), 4);
  const std::vector<double> translation = finite_list(key, *find_in(value, "translation"), 3);
  if (rotation.size() != 4 || translation.size() != 3) {
    fail(fmt::format("{} has a rotation of {} and a translation of {} numbers, expected 4 and 3",
                     key,
                     rotation.size(),
                     translation.size()));
  }
  const Eigen::Quaterniond quaternion(rotation[3], rotation[0], rotation[1], rotation[2]);
  if (!(std::abs(quaternion.norm() - 1.0) <= kMaxNormError)) {
    fail(fmt::format(
        "{} has a rotation of length {}, expected a unit quaternion", key, quaternion.norm()));
  }
  return {quaternion, {translation[0], translation[1], translation[2]}};
}

std::vector<std::pair<std::string, std::uint64_t>> MapRecord::counts(std::string_view key) {
  const msgpack::object& value = take(key);
  if (value.type != msgpack::type::MAP) fail_value(key, value, "a map of counts");
  std::vector<std::pair<std::string, std::uint64_t>> counts;
  for (std::uint32_t i = 0; i < value.via.map.size; ++i) {
    const msgpack::object_kv& entry = value.via.map.ptr[i];
    if (entry.key.type != msgpack::type::STR || entry.val.type != msgpack::type::POSITIVE_INTEGER) {
      fail_value(key, entry.val, "counts by kind");
    }
    counts.emplace_back(view(entry.key), entry.val.via.u64);
  }
  return counts;
}

std::string_view MapRecord::array_bytes(std::string_view key,
                                        const MapArrayLayout& layout,
                                        std::optional<std::size_t> count) {
  const msgpack::object& value = take(key);
  if (!is_map_of(value, {"dtype", "shape", "data"})) {
    fail_value(key, value, "an array: a map of dtype, shape and data");
  }
  const msgpack::object& dtype = *find_in(value, "dtype");
  if (dtype.type != msgpack::type::STR || view(dtype) != layout.dtype) {
    fail(fmt::format("{} has the dtype {}, expected {}", key, describe(dtype), layout.dtype));
  }
  const std::optional<std::size_t> rows = count_elements(*find_in(value, "shape"), layout);
  if (!rows || (count && *rows != *count)) {
    fail(fmt::format("{} has {}, expected {}{}{}",
                     key,
                     rows ? fmt::format("{} elements", *rows) : "another shape",
                     count ? fmt::format("{}", *count) : "any number of elements",
                     layout.element_shape.empty() ? "" : " times ",
                     fmt::join(layout.element_shape, " times ")));
  }
  std::size_t num_bytes = *rows * layout.number_bytes;
  for (const std::size_t size : layout.element_shape) num_bytes *= size;
  const msgpack::object& data = *find_in(value, "data");
  if (data.type != msgpack::type::BIN || data.via.bin.size != num_bytes) {
    fail(fmt::format("{} has as data {}, expected {} bytes", key, describe(data), num_bytes));
  }
  return {data.via.bin.ptr, data.via.bin.size};
}

void MapRecord::expect_no_more() const {
  for (const Entry& entry : entries_) {
    if (entry.is_used || entry.key == "kind" || entry.key == "id" || entry.key == "crc32c")
      continue;
    fail(fmt::format("has the key {}, expected none of that name", quote_for_message(entry.key)));
  }
}

}  // namespace waymark

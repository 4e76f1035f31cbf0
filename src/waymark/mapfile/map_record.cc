// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/map_record.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/mapfile/map_layout.h"

namespace waymark {
namespace {

using Kind = MsgpackValue::Kind;

/// The value at bytes[at] of sound bytes; steps behind it.
MsgpackElement read_element(std::string_view bytes, std::size_t& at) {
  MsgpackElement element;
  std::size_t end = at;
  WAYMARK_CHECK(skip_msgpack(bytes, end) && read_msgpack(bytes, at, element));
  element.content = bytes.substr(at, end - at);
  at = end;
  return element;
}

/// The values of an array; keys and values of a map by turns.
std::vector<MsgpackElement> elements_of(const MsgpackElement& value) {
  std::vector<MsgpackElement> elements;
  for (std::size_t at = 0; at < value.content.size();) {
    elements.push_back(read_element(value.content, at));
  }
  return elements;
}

/// The values of a map of exactly these keys, in their order; nothing for other values.
template <std::size_t kNumKeys>
std::optional<std::array<MsgpackElement, kNumKeys>> values_of(
    const MsgpackElement& value, const std::array<std::string_view, kNumKeys>& keys) {
  if (value.kind != Kind::kMap || value.size != kNumKeys) return std::nullopt;
  const std::vector<MsgpackElement> elements = elements_of(value);
  std::array<MsgpackElement, kNumKeys> values;
  for (std::size_t i = 0; i < kNumKeys; ++i) {
    std::size_t at = 0;
    while (at < elements.size() &&
           !(elements[at].kind == Kind::kText && elements[at].bytes == keys[i])) {
      at += 2;
    }
    if (at == elements.size()) return std::nullopt;
    values[i] = elements[at + 1];
  }
  return values;
}

/// The elements of a shape, or nothing where it has other rows than the layout.
std::optional<std::size_t> count_elements(const MsgpackElement& shape,
                                          const MapArrayLayout& layout) {
  if (shape.kind != Kind::kArray || shape.size != 1 + layout.element_shape.size()) {
    return std::nullopt;
  }
  const std::vector<MsgpackElement> sizes = elements_of(shape);
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    if (sizes[i].kind != Kind::kUnsigned) return std::nullopt;
    if (i > 0 && sizes[i].whole != layout.element_shape[i - 1]) return std::nullopt;
  }
  if (sizes[0].whole > kMaxArrayBytes) return std::nullopt;
  return static_cast<std::size_t>(sizes[0].whole);
}

}  // namespace

MapRecord::MapRecord(std::string_view bytes, std::string where) : where_(std::move(where)) {
  std::size_t at = 0;
  const MsgpackElement record = read_element(bytes, at);
  if (record.kind != Kind::kMap) {
    fail(fmt::format("is {}, expected a map of keys and values", describe(record)));
  }
  const std::vector<MsgpackElement> elements = elements_of(record);
  for (std::size_t i = 0; i < elements.size(); i += 2) {
    const MsgpackElement& key = elements[i];
    if (key.kind != Kind::kText) {
      fail(fmt::format("has the key {}, expected text", describe(key)));
    }
    if (has(key.bytes)) {
      fail(fmt::format("has the key {} twice, expected each once", describe(key)));
    }
    entries_.push_back({key.bytes, elements[i + 1]});
  }
}

void MapRecord::fail(const std::string& what) const { throw InputError(where_, what); }

bool MapRecord::has(std::string_view key) const {
  return std::ranges::any_of(entries_, [&](const Entry& entry) { return entry.key == key; });
}

bool MapRecord::is_nil(std::string_view key) const {
  return std::ranges::any_of(entries_, [&](const Entry& entry) {
    return entry.key == key && entry.value.kind == Kind::kNil;
  });
}

const MsgpackElement& MapRecord::take(std::string_view key) {
  for (Entry& entry : entries_) {
    if (entry.key != key) continue;
    WAYMARK_CHECK(!entry.is_used);
    entry.is_used = true;
    return entry.value;
  }
  fail(fmt::format("has no {}, expected one", key));
}

void MapRecord::fail_value(std::string_view key,
                           const MsgpackValue& value,
                           const std::string& expected) const {
  fail(fmt::format("{} is {}, expected {}", key, describe(value), expected));
}

void MapRecord::fail_element(std::string_view key, std::size_t index, double value) const {
  fail(fmt::format(
      "{} holds {} as number {}, expected one that is finite and possible", key, value, index));
}

std::uint64_t MapRecord::whole(std::string_view key, std::uint64_t max) {
  const MsgpackElement& value = take(key);
  if (value.kind != Kind::kUnsigned || value.whole > max) {
    fail_value(key, value, fmt::format("a whole number from 0 to {}", max));
  }
  return value.whole;
}

std::int64_t MapRecord::signed_whole(std::string_view key) {
  const MsgpackElement& value = take(key);
  if (value.kind == Kind::kNegative) return value.negative;
  if (value.kind != Kind::kUnsigned || value.whole > INT64_MAX) {
    fail_value(key, value, "a whole number of 64 bits");
  }
  return static_cast<std::int64_t>(value.whole);
}

bool MapRecord::flag(std::string_view key) {
  const MsgpackElement& value = take(key);
  if (value.kind != Kind::kFlag) fail_value(key, value, "true or false");
  return value.whole != 0;
}

std::string MapRecord::text(std::string_view key, std::size_t max_bytes) {
  const MsgpackElement& value = take(key);
  if (value.kind != Kind::kText || value.size > max_bytes) {
    fail_value(key, value, fmt::format("text of at most {} bytes", max_bytes));
  }
  return std::string(value.bytes);
}

std::string MapRecord::bytes(std::string_view key) {
  const MsgpackElement& value = take(key);
  if (value.kind != Kind::kBytes || value.size > kMaxArrayBytes) {
    fail_value(key, value, fmt::format("binary data of at most {} bytes", kMaxArrayBytes));
  }
  return std::string(value.bytes);
}

double MapRecord::number(std::string_view key, const NumberRange& range) {
  const MsgpackElement& value = take(key);
  if (value.kind != Kind::kFloat || !range.contains(value.number)) {
    fail_value(key, value, fmt::format("a number from {} to {}", range.low, range.high));
  }
  return value.number;
}

std::vector<double> MapRecord::numbers(std::string_view key, std::size_t max_count) {
  return finite_list(key, take(key), max_count);
}

std::vector<double> MapRecord::finite_list(std::string_view key,
                                           const MsgpackElement& value,
                                           std::size_t max_count) const {
  if (value.kind != Kind::kArray || value.size > max_count) {
    fail_value(key, value, fmt::format("a list of at most {} numbers", max_count));
  }
  std::vector<double> numbers;
  for (const MsgpackElement& element : elements_of(value)) {
    if (element.kind != Kind::kFloat || !std::isfinite(element.number)) {
      fail_value(key, element, "finite numbers");
    }
    numbers.push_back(element.number);
  }
  return numbers;
}

Rigid3 MapRecord::transform(std::string_view key) {
  const MsgpackElement& value = take(key);
  const auto parts = values_of<2>(value, {"rotation", "translation"});
  if (!parts) fail_value(key, value, "a map of rotation and translation");
  const std::vector<double> rotation = finite_list(key, (*parts)[0], 4);
  const std::vector<double> translation = finite_list(key, (*parts)[1], 3);
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
  const MsgpackElement& value = take(key);
  if (value.kind != Kind::kMap) fail_value(key, value, "a map of counts");
  const std::vector<MsgpackElement> elements = elements_of(value);
  std::vector<std::pair<std::string, std::uint64_t>> counts;
  for (std::size_t i = 0; i < elements.size(); i += 2) {
    if (elements[i].kind != Kind::kText || elements[i + 1].kind != Kind::kUnsigned) {
      fail_value(key, elements[i + 1], "counts by kind");
    }
    counts.emplace_back(elements[i].bytes, elements[i + 1].whole);
  }
  return counts;
}

std::string_view MapRecord::array_bytes(std::string_view key,
                                        const MapArrayLayout& layout,
                                        std::optional<std::size_t> count) {
  const MsgpackElement& value = take(key);
  const auto parts = values_of<3>(value, {"dtype", "shape", "data"});
  if (!parts) fail_value(key, value, "an array: a map of dtype, shape and data");
  const auto& [dtype, shape, data] = *parts;
  if (dtype.kind != Kind::kText || dtype.bytes != layout.dtype) {
    fail(fmt::format("{} has the dtype {}, expected {}", key, describe(dtype), layout.dtype));
  }
  const std::optional<std::size_t> rows = count_elements(shape, layout);
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
  if (data.kind != Kind::kBytes || data.size != num_bytes) {
    fail(fmt::format("{} has as data {}, expected {} bytes", key, describe(data), num_bytes));
  }
  return data.bytes;
}

void MapRecord::expect_no_more() const {
  for (const Entry& entry : entries_) {
    if (entry.is_used || entry.key == "kind" || entry.key == "id" || entry.key == "crc32c")
      continue;
    fail(fmt::format("has the key {}, expected none of that name", quote_for_message(entry.key)));
  }
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/msgpack_reader.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

// First bytes of values, by the table of formats of the specification.
enum Format : std::uint8_t {
  kNil = 0xc0,
  kNeverUsed = 0xc1,
  kFalse = 0xc2,
  kTrue = 0xc3,
  kBin8 = 0xc4,
  kExt8 = 0xc7,
  kFloat32 = 0xca,
  kFloat64 = 0xcb,
  kUint8 = 0xcc,
  kInt8 = 0xd0,
  kFixExt1 = 0xd4,
  kStr8 = 0xd9,
  kArray16 = 0xdc,
  kArray32 = 0xdd,
  kMap16 = 0xde,
  kMap32 = 0xdf,
};

bool is_fixed_integer(std::uint8_t first) { return first < 0x80 || first >= 0xe0; }
bool is_fixed_map(std::uint8_t first) { return (first & 0xf0) == 0x80; }
bool is_fixed_array(std::uint8_t first) { return (first & 0xf0) == 0x90; }
bool is_fixed_string(std::uint8_t first) { return (first & 0xe0) == 0xa0; }
bool is_unsigned(std::uint8_t first) { return first >= kUint8 && first < kInt8; }
bool is_signed(std::uint8_t first) { return first >= kInt8 && first < kFixExt1; }

/// What people call a value.
std::string describe_format(std::uint8_t first) {
  if (is_fixed_integer(first) || is_unsigned(first) || is_signed(first)) return "an integer";
  if (is_fixed_map(first) || first >= kMap16) return "a map";
  if (is_fixed_array(first) || first >= kArray16) return "an array";
  if (is_fixed_string(first) || first >= kStr8) return "a string";
  if (first == kFloat32 || first == kFloat64) return "a number";
  if (first == kNil) return "nil";
  if (first == kFalse || first == kTrue) return "a truth value";
  return "bytes";
}

}  // namespace

MsgpackReader::MsgpackReader(std::string_view bytes, std::string name)
    : bytes_(bytes), name_(std::move(name)) {}

void MsgpackReader::fail(const std::string& what) const {
  std::string path;
  for (const Step& step : path_) {
    if (step.key.empty()) {
      path += fmt::format("[{}]", step.index);
    } else {
      if (!path.empty()) path += '.';
      const std::string quoted = quote_for_message(step.key);
      path.append(quoted, 1, quoted.size() - 2);
    }
  }
  throw InputError(path.empty() ? name_ : name_ + ": " + path, what);
}

void MsgpackReader::fail_type(const char* expected) const {
  fail(fmt::format("is {}, expected {}", describe_format(peek()), expected));
}

void MsgpackReader::expect_size(std::size_t size, std::size_t expected) const {
  if (size != expected) fail(fmt::format("has {} elements, expected {}", size, expected));
}

void MsgpackReader::expect_end() const {
  if (at_ == bytes_.size()) return;
  fail(fmt::format("goes on after its end at byte {}, expected one MessagePack object", at_));
}

std::string_view MsgpackReader::take(std::size_t count) {
  if (count > bytes_.size() - at_) {
    fail(fmt::format("truncated: needs {} bytes at byte {}, expected them before the end at {}",
                     count,
                     at_,
                     bytes_.size()));
  }
  const std::string_view taken = bytes_.substr(at_, count);
  at_ += count;
  return taken;
}

std::uint8_t MsgpackReader::peek() const {
  if (at_ < bytes_.size()) return static_cast<std::uint8_t>(bytes_[at_]);
  fail(fmt::format("truncated at byte {}, expected a value", at_));
}

std::uint8_t MsgpackReader::take_byte() { return static_cast<std::uint8_t>(take(1)[0]); }

std::uint64_t MsgpackReader::take_unsigned(std::size_t num_bytes) {
  std::uint64_t value = 0;
  for (const char byte : take(num_bytes)) value = value << 8 | static_cast<std::uint8_t>(byte);
  return value;
}

/// A number of values, each of which takes so many bytes at least: no more than are left.
std::size_t MsgpackReader::take_size(std::size_t num_bytes, std::size_t min_bytes_each) {
  const std::uint64_t size = take_unsigned(num_bytes);
  const std::size_t left = bytes_.size() - at_;
  if (size > left / min_bytes_each) {
    fail(
        fmt::format("truncated: claims {} elements at byte {}, expected no more than {} bytes hold",
                    size,
                    at_,
                    left));
  }
  return static_cast<std::size_t>(size);
}

std::size_t MsgpackReader::map_size() {
  const std::uint8_t first = peek();
  if (!is_fixed_map(first) && first != kMap16 && first != kMap32) fail_type("a map");
  ++at_;
  if (is_fixed_map(first)) return first & 0x0f;
  return take_size(first == kMap16 ? 2 : 4, 2);
}

std::size_t MsgpackReader::array_size() {
  const std::uint8_t first = peek();
  if (!is_fixed_array(first) && first != kArray16 && first != kArray32) fail_type("an array");
  ++at_;
  if (is_fixed_array(first)) return first & 0x0f;
  return take_size(first == kArray16 ? 2 : 4, 1);
}

std::string_view MsgpackReader::read_string() {
  const std::uint8_t first = peek();
  if (!is_fixed_string(first) && (first < kStr8 || first >= kArray16)) fail_type("a string");
  ++at_;
  if (is_fixed_string(first)) return take(first & 0x1f);
  return take(static_cast<std::size_t>(take_unsigned(std::size_t{1} << (first - kStr8))));
}

bool MsgpackReader::is_number() const {
  const std::uint8_t first = peek();
  return is_fixed_integer(first) || is_unsigned(first) || is_signed(first) || first == kFloat32 ||
         first == kFloat64;
}

double MsgpackReader::read_number(double max) {
  const std::uint8_t first = peek();
  double value = 0.0;
  if (first == kFloat32) {
    ++at_;
    value = std::bit_cast<float>(static_cast<std::uint32_t>(take_unsigned(4)));
  } else if (first == kFloat64) {
    ++at_;
    value = std::bit_cast<double>(take_unsigned(8));
  } else {
    if (!is_number()) fail_type("a number");
    value = static_cast<double>(read_integer(INT64_MIN, INT64_MAX));
  }
  if (!(std::abs(value) <= max)) {
    fail(fmt::format("is {}, expected a number between -{:g} and {:g}", value, max, max));
  }
  return value;
}

std::int64_t MsgpackReader::read_integer(std::int64_t low, std::int64_t high) {
  const std::uint8_t first = peek();
  if (!is_fixed_integer(first) && !is_unsigned(first) && !is_signed(first)) {
    fail_type("an integer");
  }
  ++at_;
  std::int64_t value = static_cast<std::int8_t>(first);
  bool is_too_large = false;
  if (is_unsigned(first)) {
    const std::uint64_t bits = take_unsigned(std::size_t{1} << (first - kUint8));
    value = static_cast<std::int64_t>(bits);
    is_too_large = value < 0;
  } else if (is_signed(first)) {
    const std::size_t num_bytes = std::size_t{1} << (first - kInt8);
    const std::size_t shift = 64 - 8 * num_bytes;  // Extends the sign.
    value = static_cast<std::int64_t>(take_unsigned(num_bytes) << shift) >> shift;
  }
  if (is_too_large || value < low || value > high) {
    fail(fmt::format(
        "is {}, expected an integer from {} to {}",
        is_too_large ? fmt::to_string(static_cast<std::uint64_t>(value)) : fmt::to_string(value),
        low,
        high));
  }
  return value;
}

std::size_t MsgpackReader::skip_one() {
  const std::uint8_t first = peek();
  if (is_fixed_map(first) || first == kMap16 || first == kMap32) return 2 * map_size();
  if (is_fixed_array(first) || first == kArray16 || first == kArray32) return array_size();
  if (is_fixed_string(first) || (first >= kStr8 && first < kArray16)) {
    read_string();
    return 0;
  }
  if (first == kNeverUsed) fail("holds the byte 0xc1, expected MessagePack, which has no such");
  ++at_;
  if (is_unsigned(first)) {
    take(std::size_t{1} << (first - kUint8));
  } else if (is_signed(first)) {
    take(std::size_t{1} << (first - kInt8));
  } else if (first == kFloat32 || first == kFloat64) {
    take(first == kFloat32 ? 4 : 8);
  } else if (first >= kFixExt1 && first < kStr8) {
    take(1 + (std::size_t{1} << (first - kFixExt1)));
  } else if (first >= kExt8 && first < kFloat32) {
    const std::uint64_t size = take_unsigned(std::size_t{1} << (first - kExt8));
    take(1 + static_cast<std::size_t>(size));
  } else if (first >= kBin8 && first < kExt8) {
    take(static_cast<std::size_t>(take_unsigned(std::size_t{1} << (first - kBin8))));
  }
  return 0;
}

void MsgpackReader::skip() {
  for (std::size_t left = 1; left > 0; --left) left += skip_one();
}

void MsgpackReader::read_record(std::span<const Field> fields) {
  WAYMARK_CHECK(fields.size() <= 64);
  std::uint64_t seen = 0;
  read_map([&](std::string_view key) {
    for (std::size_t i = 0; i < fields.size(); ++i) {
      if (fields[i].key != key) continue;
      if (seen >> i & 1) fail("is there twice, expected once");
      seen |= std::uint64_t{1} << i;
      return fields[i].read();
    }
    skip();
  });
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (fields[i].is_required && !(seen >> i & 1)) {
      fail(fmt::format("has no {}, which is needed", fields[i].key));
    }
  }
}

}  // namespace waymark

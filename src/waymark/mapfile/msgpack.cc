// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/msgpack.h"

#include <fmt/format.h>

#include <array>
#include <bit>

#include "waymark/base/text.h"

namespace waymark {
namespace {

using Kind = MsgpackValue::Kind;

/// What follows a first byte: a number of so many bytes, which is the value or its size.
struct Format {
  Kind kind;
  std::size_t num_bytes;
};

/// First bytes from 0xc0 on, by the table of formats of the specification. Extensions of fixed size
/// have no number.
constexpr std::size_t kFirstFormat = 0xc0;
constexpr std::array<Format, 32> kFormats = {{
    {Kind::kNil, 0},       {Kind::kNone, 0},      {Kind::kFlag, 0},      {Kind::kFlag, 0},
    {Kind::kBytes, 1},     {Kind::kBytes, 2},     {Kind::kBytes, 4},     {Kind::kExtension, 1},
    {Kind::kExtension, 2}, {Kind::kExtension, 4}, {Kind::kFloat, 4},     {Kind::kFloat, 8},
    {Kind::kUnsigned, 1},  {Kind::kUnsigned, 2},  {Kind::kUnsigned, 4},  {Kind::kUnsigned, 8},
    {Kind::kNegative, 1},  {Kind::kNegative, 2},  {Kind::kNegative, 4},  {Kind::kNegative, 8},
    {Kind::kExtension, 0}, {Kind::kExtension, 0}, {Kind::kExtension, 0}, {Kind::kExtension, 0},
    {Kind::kExtension, 0}, {Kind::kText, 1},      {Kind::kText, 2},      {Kind::kText, 4},
    {Kind::kArray, 2},     {Kind::kArray, 4},     {Kind::kMap, 2},       {Kind::kMap, 4},
}};

std::uint64_t read_big_endian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (const char byte : bytes) value = value << 8 | static_cast<std::uint8_t>(byte);
  return value;
}

void append_big_endian(std::string& bytes, std::uint64_t value, std::size_t num_bytes) {
  for (std::size_t i = num_bytes; i > 0; --i) {
    bytes.push_back(static_cast<char>(value >> (8 * (i - 1)) & 0xff));
  }
}

void set_signed(std::uint64_t bits, std::size_t num_bytes, MsgpackValue& value) {
  const std::size_t shift = 64 - 8 * num_bytes;  // Extends the sign.
  value.negative = static_cast<std::int64_t>(bits << shift) >> shift;
  if (value.negative < 0) return;
  value.kind = Kind::kUnsigned;
  value.whole = bits;
}

/// The value of a first byte that says all, or the kind and size that it says.
void set_from_first(std::uint8_t first, MsgpackValue& value) {
  if (first < 0x80) {
    value.kind = Kind::kUnsigned;
    value.whole = first;
  } else if (first < 0x90) {
    value.kind = Kind::kMap;
    value.size = first & 0x0f;
  } else if (first < 0xa0) {
    value.kind = Kind::kArray;
    value.size = first & 0x0f;
  } else if (first < kFirstFormat) {
    value.kind = Kind::kText;
    value.size = first & 0x1f;
  } else {
    value.kind = Kind::kNegative;
    value.negative = static_cast<std::int8_t>(first);
  }
}

void set_from_number(std::uint8_t first, std::string_view bytes, MsgpackValue& value) {
  const std::uint64_t number = read_big_endian(bytes);
  switch (value.kind) {
    case Kind::kFlag:
      value.whole = first & 1;
      return;
    case Kind::kUnsigned:
      value.whole = number;
      return;
    case Kind::kNegative:
      return set_signed(number, bytes.size(), value);
    case Kind::kFloat:
      value.number = bytes.size() == 4 ? std::bit_cast<float>(static_cast<std::uint32_t>(number))
                                       : std::bit_cast<double>(number);
      return;
    case Kind::kExtension:  // Its type is a byte more.
      value.size = 1 + (bytes.empty() ? std::size_t{1} << (first - 0xd4) : number);
      return;
    default:
      value.size = number;
  }
}

/// A size in the first byte where it is below `num_fixed`, else in formats from `wide` on, whose
/// sizes double.
void append_size(std::string& bytes,
                 std::uint64_t size,
                 std::uint8_t fixed,
                 std::size_t num_fixed,
                 std::uint8_t wide,
                 std::size_t num_bytes) {
  if (size < num_fixed) {
    bytes.push_back(static_cast<char>(fixed | size));
    return;
  }
  for (; num_bytes < 8 && size >> (8 * num_bytes) != 0; num_bytes *= 2) ++wide;
  bytes.push_back(static_cast<char>(wide));
  append_big_endian(bytes, size, num_bytes);
}

}  // namespace

bool read_msgpack(std::string_view bytes, std::size_t& at, MsgpackValue& value) {
  value = {};
  if (at >= bytes.size()) return false;
  const auto first = static_cast<std::uint8_t>(bytes[at]);
  std::string_view rest = bytes.substr(at + 1);
  if (first < kFirstFormat || first >= kFirstFormat + kFormats.size()) {
    set_from_first(first, value);
  } else {
    const Format& format = kFormats[first - kFirstFormat];
    value.kind = format.kind;
    if (rest.size() < format.num_bytes) return false;
    set_from_number(first, rest.substr(0, format.num_bytes), value);
    rest.remove_prefix(format.num_bytes);
  }
  if (value.kind == Kind::kArray && value.size > rest.size()) return false;
  if (value.kind == Kind::kMap && value.size > rest.size() / 2) return false;
  if (value.kind == Kind::kText || value.kind == Kind::kBytes || value.kind == Kind::kExtension) {
    if (value.size > rest.size()) return false;
    value.bytes = rest.substr(0, value.size);
    rest.remove_prefix(value.size);
  }
  at = bytes.size() - rest.size();
  return true;
}

bool skip_msgpack(std::string_view bytes, std::size_t& at) {
  MsgpackValue value;
  for (std::size_t left = 1; left > 0; --left) {
    std::size_t next = at;
    if (!read_msgpack(bytes, next, value) || value.kind == Kind::kNone) return false;
    at = next;
    if (value.kind == Kind::kArray) left += value.size;
    if (value.kind == Kind::kMap) left += 2 * value.size;
  }
  return true;
}

std::string describe(const MsgpackValue& value) {
  switch (value.kind) {
    case Kind::kNil:
      return "nil";
    case Kind::kFlag:
      return value.whole ? "true" : "false";
    case Kind::kUnsigned:
      return fmt::to_string(value.whole);
    case Kind::kNegative:
      return fmt::to_string(value.negative);
    case Kind::kFloat:
      return fmt::to_string(value.number);
    case Kind::kText:
      return quote_for_message(value.bytes);
    case Kind::kBytes:
      return fmt::format("{} bytes", value.size);
    case Kind::kArray:
      return fmt::format("a list of {}", value.size);
    case Kind::kMap:
      return fmt::format("a map of {} keys", value.size);
    default:
      return "an extension";
  }
}

void pack_nil(std::string& bytes) { bytes.push_back('\xc0'); }

void pack_flag(std::string& bytes, bool value) { bytes.push_back(value ? '\xc3' : '\xc2'); }

void pack_unsigned(std::string& bytes, std::uint64_t value) {
  append_size(bytes, value, 0, 0x80, 0xcc, 1);
}

void pack_signed(std::string& bytes, std::int64_t value) {
  if (value >= 0) return pack_unsigned(bytes, static_cast<std::uint64_t>(value));
  if (value >= -32) return bytes.push_back(static_cast<char>(value));
  std::size_t num_bytes = 1;
  std::uint8_t first = 0xd0;
  for (; num_bytes < 8 && value < -(std::int64_t{1} << (8 * num_bytes - 1)); num_bytes *= 2)
    ++first;
  bytes.push_back(static_cast<char>(first));
  append_big_endian(bytes, static_cast<std::uint64_t>(value), num_bytes);
}

void pack_number(std::string& bytes, double value) {
  bytes.push_back('\xcb');
  append_big_endian(bytes, std::bit_cast<std::uint64_t>(value), 8);
}

void pack_numbers(std::string& bytes, std::span<const double> values) {
  pack_array_size(bytes, values.size());
  for (const double value : values) pack_number(bytes, value);
}

void pack_text(std::string& bytes, std::string_view text) {
  append_size(bytes, text.size(), 0xa0, 32, 0xd9, 1);
  bytes += text;
}

void pack_bytes(std::string& bytes, std::string_view data) {
  append_size(bytes, data.size(), 0, 0, 0xc4, 1);
  bytes += data;
}

void pack_array_size(std::string& bytes, std::size_t num_elements) {
  append_size(bytes, num_elements, 0x90, 16, 0xdc, 2);
}

void pack_map_size(std::string& bytes, std::size_t num_pairs) {
  append_size(bytes, num_pairs, 0x80, 16, 0xde, 2);
}

void pack_uint32(std::string& bytes, std::uint32_t value) {
  bytes.push_back('\xce');
  append_big_endian(bytes, value, 4);
}

}  // namespace waymark

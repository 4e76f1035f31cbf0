// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace waymark {

// MessagePack (msgpack.org, the specification of 2013), as far as files of maps need it.

/// A value of foreign bytes: all of a scalar, of an array or map the number of values inside, which
/// follow it.
struct MsgpackValue {
  enum class Kind {
    kNil,
    kFlag,
    kUnsigned,  ///< Whole and not negative, however it was written.
    kNegative,
    kFloat,
    kText,
    kBytes,
    kExtension,
    kArray,
    kMap,
    kNone,  ///< No MessagePack.
  };

  Kind kind = Kind::kNone;
  std::uint64_t whole = 0;    ///< Of kUnsigned; 0 or 1 of kFlag.
  std::int64_t negative = 0;  ///< Of kNegative.
  double number = 0.0;        ///< Of kFloat.
  std::size_t size = 0;       ///< Bytes of text, bytes and extensions, elements, pairs of a map.
  std::string_view bytes;     ///< Those of text, bytes and extensions.
};

/// Reads the value at bytes[at] and steps behind it. False where the bytes end too soon, for an
/// array or map already if there cannot be as many values as it claims; `value` then holds what is
/// known, and `at` stays.
bool read_msgpack(std::string_view bytes, std::size_t& at, MsgpackValue& value);

/// Steps behind the value at bytes[at] and all that is in it. Neither recurses nor allocates. False
/// where the bytes end too soon or are no MessagePack; `at` is there then.
bool skip_msgpack(std::string_view bytes, std::size_t& at);

/// The value in words, short whatever it is.
std::string describe(const MsgpackValue& value);

// Each appends a value in the shortest format that holds it.

void pack_nil(std::string& bytes);
void pack_flag(std::string& bytes, bool value);
void pack_unsigned(std::string& bytes, std::uint64_t value);
void pack_signed(std::string& bytes, std::int64_t value);
/// Always 64 bits, of whole numbers, too.
void pack_number(std::string& bytes, double value);
void pack_numbers(std::string& bytes, std::span<const double> values);
void pack_text(std::string& bytes, std::string_view text);
void pack_bytes(std::string& bytes, std::string_view data);
/// What is in it has to follow.
void pack_array_size(std::string& bytes, std::size_t num_elements);
void pack_map_size(std::string& bytes, std::size_t num_pairs);
/// An unsigned number in the format of 32 bits, whatever it is: always five bytes.
void pack_uint32(std::string& bytes, std::uint32_t value);

}  // namespace waymark

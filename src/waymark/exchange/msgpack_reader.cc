// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/msgpack_reader.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

using Kind = MsgpackValue::Kind;

/// What people call a value.
const char* name_of(Kind kind) {
  switch (kind) {
    case Kind::kNil:
      return "nil";
    case Kind::kFlag:
      return "a truth value";
    case Kind::kUnsigned:
    case Kind::kNegative:
      return "an integer";
    case Kind::kFloat:
      return "a number";
    case Kind::kText:
      return "a string";
    case Kind::kArray:
      return "an array";
    case Kind::kMap:
      return "a map";
    default:
      return "bytes";
  }
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

void MsgpackReader::expect_size(std::size_t size, std::size_t expected) const {
  if (size != expected) fail(fmt::format("has {} elements, expected {}", size, expected));
}

void MsgpackReader::expect_end() const {
  if (at_ == bytes_.size()) return;
  fail(fmt::format("goes on after its end at byte {}, expected one MessagePack object", at_));
}

MsgpackValue MsgpackReader::peek(std::size_t& end) const {
  MsgpackValue value;
  end = at_;
  if (!read_msgpack(bytes_, end, value)) {
    fail(fmt::format("truncated: its value at byte {} goes on, expected it to end before byte {}",
                     at_,
                     bytes_.size()));
  }
  if (value.kind == Kind::kNone) {
    fail("holds the byte 0xc1, expected MessagePack, which has no such");
  }
  return value;
}

MsgpackValue MsgpackReader::take(Kind kind, const char* expected) {
  std::size_t end = at_;
  const MsgpackValue value = peek(end);
  if (value.kind != kind) fail(fmt::format("is {}, expected {}", name_of(value.kind), expected));
  at_ = end;
  return value;
}

std::string_view MsgpackReader::read_string() { return take(Kind::kText, "a string").bytes; }

bool MsgpackReader::is_number() const {
  std::size_t end = at_;
  const Kind kind = peek(end).kind;
  return kind == Kind::kUnsigned || kind == Kind::kNegative || kind == Kind::kFloat;
}

double MsgpackReader::read_number(double max) {
  std::size_t end = at_;
  const MsgpackValue value = peek(end);
  double number = value.number;
  if (value.kind == Kind::kUnsigned) {
    number = static_cast<double>(value.whole);
  } else if (value.kind == Kind::kNegative) {
    number = static_cast<double>(value.negative);
  } else {
    take(Kind::kFloat, "a number");
  }
  at_ = end;
  if (!(std::abs(number) <= max)) {
    fail(fmt::format("is {}, expected a number between -{:g} and {:g}", number, max, max));
  }
  return number;
}

std::int64_t MsgpackReader::read_integer(std::int64_t low, std::int64_t high) {
  std::size_t end = at_;
  const MsgpackValue value = peek(end);
  if (value.kind != Kind::kNegative) take(Kind::kUnsigned, "an integer");
  at_ = end;
  const bool is_negative = value.kind == Kind::kNegative;
  const bool is_within = is_negative ? value.negative >= low && value.negative <= high
                                     : std::cmp_greater_equal(value.whole, low) &&
                                           std::cmp_less_equal(value.whole, high);
  if (!is_within) {
    fail(fmt::format("is {}, expected an integer from {} to {}", describe(value), low, high));
  }
  return is_negative ? value.negative : static_cast<std::int64_t>(value.whole);
}

void MsgpackReader::skip() {
  std::size_t end = 0;
  if (!skip_msgpack(bytes_, at_)) peek(end);  // Which says what is wrong there.
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

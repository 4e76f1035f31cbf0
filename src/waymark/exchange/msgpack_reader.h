// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/mapfile/msgpack.h"

namespace waymark {

/// Reads one MessagePack object (msgpack.org, the specification of 2013) front to back, value by
/// value, without a tree in memory: nothing is allocated for what the caller does not keep, and
/// nothing recurses. Whatever is not as the caller expects is an InputError that names the file,
/// the way to the value, such as "keyframes.12.undist_keypts[3].pt", and what was expected.
class MsgpackReader {
 public:
  /// A value of a map that is read as a record.
  struct Field {
    std::string_view key;
    std::function<void()> read;  ///< Consumes the value.
    bool is_required = true;
  };

  /// The bytes must outlive the reader; name is what errors call the file.
  MsgpackReader(std::string_view bytes, std::string name);

  /// Reads a map; visit(key) must consume the value of each. Keys are strings.
  template <class Visit>
  void read_map(Visit visit);
  /// Reads a map with known keys, in any order, each once at most. Others are passed over.
  void read_record(std::span<const Field> fields);
  /// Reads an array of at most so many elements, which visit(index) must consume; visit is told of
  /// the number first.
  template <class Resize, class Visit>
  void read_array(std::size_t max_size, Resize resize, Visit visit);
  /// The same for an array of just so many elements.
  template <class Visit>
  void read_array_of(std::size_t size, Visit visit);

  std::string_view read_string();
  /// An integer or a floating-point number, finite, of magnitude max at most.
  double read_number(double max);
  std::int64_t read_integer(std::int64_t low, std::int64_t high);
  /// Passes over a value, whatever it is.
  void skip();
  bool is_number() const;

  /// Fails unless everything was read.
  void expect_end() const;
  /// InputError at the value that is being read.
  [[noreturn]] void fail(const std::string& what) const;

 private:
  struct Step {
    std::string_view key;
    std::size_t index = 0;  ///< Of an array where the key is empty.
  };

  /// The value that comes next, which stays; what it holds follows from `end` on.
  MsgpackValue peek(std::size_t& end) const;
  /// Consumes a value of one kind, of an array or map all but what is in it.
  MsgpackValue take(MsgpackValue::Kind kind, const char* expected);
  void expect_size(std::size_t size, std::size_t expected) const;

  std::string_view bytes_;
  std::size_t at_ = 0;
  std::string name_;
  std::vector<Step> path_;
};

template <class Visit>
void MsgpackReader::read_map(Visit visit) {
  const std::size_t size = take(MsgpackValue::Kind::kMap, "a map").size;
  for (std::size_t i = 0; i < size; ++i) {
    const std::string_view key = read_string();
    path_.push_back({key, i});
    visit(key);
    path_.pop_back();
  }
}

template <class Resize, class Visit>
void MsgpackReader::read_array(std::size_t max_size, Resize resize, Visit visit) {
  const std::size_t size = take(MsgpackValue::Kind::kArray, "an array").size;
  if (size > max_size) {
    fail("has " + std::to_string(size) + " elements, expected at most " + std::to_string(max_size));
  }
  resize(size);
  for (std::size_t i = 0; i < size; ++i) {
    path_.push_back({{}, i});
    visit(i);
    path_.pop_back();
  }
}

template <class Visit>
void MsgpackReader::read_array_of(std::size_t size, Visit visit) {
  read_array(
      SIZE_MAX, [&](std::size_t found) { expect_size(found, size); }, visit);
}

}  // namespace waymark

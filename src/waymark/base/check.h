// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What comes from outside and is wrong is an InputError of one line; a broken promise of our own
// code fails a check.
//
//   try {
//     const StoredMap stored = load_map("house.wmap");
//     WAYMARK_CHECK(stored.map != nullptr);
//   } catch (const InputError& error) {
//     std::cerr << "error: " << error.what() << "\n";
//   }

#include <stdexcept>
#include <string>

namespace waymark {

/// Bad input from outside (file, setting, image, argument). The message reads
/// "WHERE: what is wrong, what was expected" on one line: control characters that a name or a
/// quotation brings along come out as their hexadecimal codes.
class InputError : public std::runtime_error {
 public:
  /// where: file and line, setting or argument; what: what is wrong and what was expected.
  InputError(const std::string& where, const std::string& what);
};

/// The results cannot be written or the work cannot be finished; same form of message.
class OutputError : public std::runtime_error {
 public:
  /// where: the file or device; what: why it cannot be written.
  OutputError(const std::string& where, const std::string& what);
  /// A whole message of that form.
  explicit OutputError(const std::string& message);
};

/// A broken promise of our own code.
class CheckError : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

/// Throws the CheckError of WAYMARK_CHECK.
[[noreturn]] inline void fail_check(const char* condition, const char* file, int line) {
  throw CheckError(std::string(file) + ":" + std::to_string(line) + ": check failed: " + condition);
}

}  // namespace waymark

/// Fails with a CheckError that names the condition and the place; active in every build.
#define WAYMARK_CHECK(condition) \
  ((condition) ? static_cast<void>(0) : ::waymark::fail_check(#condition, __FILE__, __LINE__))

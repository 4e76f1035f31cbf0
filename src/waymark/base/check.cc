// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/check.h"

#include <fmt/format.h>

namespace waymark {
namespace {

/// Control characters of ASCII come out as \xNN; names of files stay the bytes that they are.
std::string one_line(const std::string& text) {
  std::string line;
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (code < 0x20 || code == 0x7F) {
      line += fmt::format("\\x{:02x}", code);
    } else {
      line += c;
    }
  }
  return line;
}

}  // namespace

InputError::InputError(const std::string& where, const std::string& what)
    : std::runtime_error(one_line(where + ": " + what)) {}

OutputError::OutputError(const std::string& where, const std::string& what)
    : std::runtime_error(one_line(where + ": " + what)) {}

OutputError::OutputError(const std::string& message) : std::runtime_error(one_line(message)) {}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string_view>
#include <utility>

#include "waymark/base/text.h"

/// The standard streams, which may be closed, full or nobody's any more: writing to them never
/// throws, since what was computed is worth more than what is said of it. Control characters in
/// what is printed, which may hold texts of files or their names, do not reach the terminal.
namespace waymark {

/// Opens what is closed of the standard streams to nowhere, so that no file that is opened later
/// takes their place; standard output then still fails when it is written to.
void keep_standard_streams();

/// Takes standard error for the program's own messages. What libraries say there of bad images,
/// in words that help nobody and with --quiet, too, goes nowhere from now on.
void silence_libraries();

/// Where messages go: standard error.
std::FILE* message_stream();

/// Writes to a stream; std::ferror() tells when that failed.
void write_text(std::FILE* stream, std::string_view text);

/// Results that were asked for, to standard output.
template <class... Arguments>
void print_result(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  write_text(
      stdout,
      printable(fmt::format(format, std::forward<Arguments>(arguments)...), /*has_lines=*/true));
}

/// Messages, to standard error.
template <class... Arguments>
void print_message(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  write_text(
      message_stream(),
      printable(fmt::format(format, std::forward<Arguments>(arguments)...), /*has_lines=*/true));
}

/// Throws OutputError when something written to standard output got lost.
void check_standard_output();

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "terminal.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <iostream>
#include <system_error>

#include "waymark/base/check.h"

namespace waymark {
namespace {

std::FILE* own_stream = nullptr;  ///< Once libraries are silenced.

}  // namespace

void keep_standard_streams() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(descriptor, F_GETFD) >= 0 || errno != EBADF) continue;
    // The lowest number that is free is this one.
    [[maybe_unused]] const int opened = open("/dev/null", O_RDONLY);
  }
}

void silence_libraries() {
  std::cerr.setstate(std::ios_base::failbit);
  std::FILE* const nowhere = std::fopen("/dev/null", "w");
  if (nowhere == nullptr) return;
  own_stream = fdopen(STDERR_FILENO, "w");
  if (own_stream == nullptr) return;
  std::setvbuf(own_stream, nullptr, _IONBF, 0);
  stderr = nowhere;  // In glibc a variable as any other, which is documented.
}

std::FILE* message_stream() { return own_stream ? own_stream : stderr; }

void write_text(std::FILE* stream, std::string_view text) {
  [[maybe_unused]] const std::size_t written = std::fwrite(text.data(), 1, text.size(), stream);
}

void check_standard_output() {
  std::cout.flush();  // The parser of the command line writes its help there.
  errno = 0;
  if (std::fflush(stdout) == 0 && !std::ferror(stdout) && std::cout) return;
  throw OutputError("standard output",
                    fmt::format("cannot be written: {}, expected a reader or enough space",
                                errno ? std::generic_category().message(errno) : "it was refused"));
}

}  // namespace waymark

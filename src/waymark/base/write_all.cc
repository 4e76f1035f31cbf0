// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/write_all.h"

#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <ctime>
#include <system_error>

namespace waymark {
namespace {

/// Writing beyond the file size limit (ulimit -f) sends SIGXFSZ, which by default kills the
/// program. For the duration of this scope the calling thread holds it back and swallows it, so
/// that write() reports EFBIG instead; other threads and the handlers of the process are untouched.
class FileSizeSignalGuard {
 public:
  FileSizeSignalGuard() {
    sigemptyset(&signal_);
    sigaddset(&signal_, SIGXFSZ);
    sigset_t pending;
    sigpending(&pending);
    was_pending_ = sigismember(&pending, SIGXFSZ) == 1;
    pthread_sigmask(SIG_BLOCK, &signal_, &before_);
  }
  ~FileSizeSignalGuard() {
    const int saved_errno = errno;
    if (!was_pending_) {
      const timespec no_wait{};
      while (sigtimedwait(&signal_, nullptr, &no_wait) > 0) {
      }
    }
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
    errno = saved_errno;
  }
  FileSizeSignalGuard(const FileSizeSignalGuard&) = delete;
  FileSizeSignalGuard& operator=(const FileSizeSignalGuard&) = delete;

 private:
  sigset_t signal_;
  sigset_t before_;
  bool was_pending_ = false;
};

}  // namespace

int write_all(int descriptor, std::string_view bytes) {
  const FileSizeSignalGuard guard;
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return written < 0 ? errno : ENOSPC;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

std::string error_text(int error_number) { return std::generic_category().message(error_number); }

}  // namespace waymark

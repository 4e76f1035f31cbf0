// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/scratch_folder.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/write_all.h"

namespace waymark {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLockName = "lock";
constexpr int kMaxTries = 100;

/// The lock of a folder, a file in it that is made if need be, so that whoever removes the folder
/// and whoever has just made it ask for the same; -1 where somebody else has it or it went.
int take_lock(const fs::path& folder) {
  const fs::path path = folder / kLockName;
  const int lock = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
  if (lock < 0) return -1;
  struct stat there {
  }, taken{};
  if (::flock(lock, LOCK_EX | LOCK_NB) == 0 && ::stat(path.c_str(), &there) == 0 &&
      ::fstat(lock, &taken) == 0 && there.st_ino == taken.st_ino) {
    return lock;
  }
  const int error = errno;
  ::close(lock);
  errno = error;
  return -1;
}

fs::path folder_with(const fs::path& prefix) {
  return prefix.has_parent_path() ? prefix.parent_path() : fs::path(".");
}

}  // namespace

ScratchFolder::ScratchFolder(const fs::path& prefix) {
  // Between its making and its locking somebody may take it for a left one.
  for (int i = 0; i < kMaxTries && lock_ < 0; ++i) {
    std::string name = prefix.string() + "XXXXXX";
    if (::mkdtemp(name.data()) == nullptr) break;
    ::chmod(name.c_str(), 0755);
    path_ = name;
    lock_ = take_lock(path_);
    std::error_code ignored;
    if (lock_ < 0) fs::remove_all(path_, ignored);
  }
  if (lock_ < 0) {
    throw OutputError(folder_with(prefix).string(),
                      "cannot be written: " + error_text(errno) +
                          ", expected a folder that can be written and locked");
  }
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  ::close(lock_);
}

void remove_abandoned_scratch(const fs::path& prefix) {
  const std::string start = prefix.filename().string();
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::directory_iterator entry(folder_with(prefix), error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().filename().string().starts_with(start)) found.push_back(entry->path());
  }
  for (const fs::path& path : found) {
    std::error_code ignored;
    if (!fs::is_directory(fs::symlink_status(path, ignored))) {
      fs::remove(path, ignored);
      continue;
    }
    const int lock = take_lock(path);
    if (lock < 0) continue;
    fs::remove_all(path, ignored);
    ::close(lock);
  }
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <exception>
#include <optional>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/failure.h"
#include "waymark/base/write_all.h"

namespace waymark {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 16;
constexpr int kMaxNames = 1000;

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

/// "." + name + "." + process + "-" + number + ".partial".
std::string partial_prefix(const std::filesystem::path& path) {
  return fmt::format(".{}.", path.filename().string());
}
constexpr std::string_view kPartialSuffix = ".partial";

/// The process that made a partial file of this prefix; nothing for other names.
std::optional<pid_t> maker_of(std::string_view name, std::string_view prefix) {
  if (!name.starts_with(prefix) || !name.ends_with(kPartialSuffix)) return std::nullopt;
  const std::string_view rest = name.substr(prefix.size());
  pid_t process = 0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), process);
  if (error != std::errc() || *end != '-' || process <= 0) return std::nullopt;
  return process;
}

}  // namespace

AtomicFile::AtomicFile(const std::filesystem::path& path) : path_(path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    throw OutputError(path.string(), "is no regular file, expected a file or a new name");
  }
  // A link keeps pointing to where it points: the file behind it is what gets replaced.
  if (std::filesystem::is_symlink(path, error)) {
    const std::filesystem::path target = std::filesystem::weakly_canonical(path, error);
    if (!error) path_ = target;
  }
  for (int i = 0; i < kMaxNames && descriptor_ < 0; ++i) {
    temporary_ = folder_of(path_) /
                 fmt::format("{}{}-{}{}", partial_prefix(path_), ::getpid(), i, kPartialSuffix);
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor_ < 0 && errno != EEXIST) break;
  }
  if (descriptor_ < 0) {
    throw OutputError(path_.string(),
                      fmt::format("cannot be made: {}, expected a folder that can be written",
                                  error_text(errno)));
  }
  buffer_.reserve(kBufferBytes);
}

AtomicFile::~AtomicFile() { discard(); }

void AtomicFile::write(std::string_view bytes) {
  WAYMARK_CHECK(descriptor_ >= 0);
  while (!bytes.empty()) {
    const std::string_view part = bytes.substr(0, kBufferBytes - buffer_.size());
    buffer_.append(part);
    bytes.remove_prefix(part.size());
    if (buffer_.size() == kBufferBytes) flush();
  }
}

void AtomicFile::commit() {
  WAYMARK_CHECK(descriptor_ >= 0);
  flush();
  if (::fsync(descriptor_) != 0) fail("be flushed to the disk", errno);
  const int closed = ::close(descriptor_);
  descriptor_ = -1;
  if (closed != 0) fail("be closed", errno);
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) fail("be renamed", errno);
  temporary_.clear();
  flush_folder(folder_of(path_));
}

void AtomicFile::flush() {
  if (const int error = write_all(descriptor_, buffer_)) fail("be written", error);
  buffer_.clear();
}

void AtomicFile::discard() noexcept {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
  temporary_.clear();
}

void AtomicFile::fail(std::string_view action, int error_number) {
  discard();
  throw OutputError(path_.string(),
                    fmt::format("cannot {}: {}, expected enough space and the right to write",
                                action,
                                error_text(error_number)));
}

void write_file_atomically(const std::filesystem::path& path, std::string_view content) {
  AtomicFile file(path);
  file.write(content);
  file.commit();
}

void save_each(std::initializer_list<std::function<void()>> saves) {
  std::exception_ptr first;
  std::string messages;
  int num_failures = 0;
  for (const auto& save : saves) {
    try {
      save();
    } catch (const std::exception&) {
      if (num_failures++ == 0) first = std::current_exception();
      messages += (messages.empty() ? "" : "; ") + describe_failure(std::current_exception());
    }
  }
  if (num_failures == 1) std::rethrow_exception(first);
  if (num_failures > 1) throw OutputError(messages);
}

void remove_abandoned_parts(const std::filesystem::path& path) {
  const std::string prefix = partial_prefix(path);
  std::vector<std::filesystem::path> abandoned;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder_of(path), error), end;
       !error && entry != end;
       entry.increment(error)) {
    const std::optional<pid_t> maker = maker_of(entry->path().filename().string(), prefix);
    if (maker && ::kill(*maker, 0) != 0 && errno == ESRCH) abandoned.push_back(entry->path());
  }
  for (const std::filesystem::path& part : abandoned) std::filesystem::remove(part, error);
}

/// After a rename the name itself is on the disk only when the folder is flushed too. File systems
/// that cannot do that are no reason to fail: the content is safe by then.
void flush_folder(const std::filesystem::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

void make_output_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  std::error_code ignored;
  if (std::filesystem::is_directory(folder, ignored)) return;
  throw OutputError(folder.string(),
                    fmt::format("cannot be made: {}, expected a folder that can be written",
                                error ? error.message() : "a file is in the way"));
}

}  // namespace waymark

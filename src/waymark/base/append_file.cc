// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/append_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/write_all.h"

namespace waymark {
namespace {

constexpr std::size_t kFlushBytes = std::size_t{1} << 16;

}  // namespace

AppendFile::AppendFile(std::filesystem::path path) : path_(std::move(path)) {
  descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor_ < 0) fail("be made", errno);
}

AppendFile::~AppendFile() {
  if (descriptor_ < 0) return;
  take_back();
  ::close(descriptor_);
}

void AppendFile::write(std::string_view bytes) {
  buffer_.append(bytes);
  if (buffer_.size() >= kFlushBytes) flush();
}

void AppendFile::commit() {
  flush();
  if (::fsync(descriptor_) != 0) fail("be flushed to the disk", errno);
  committed_bytes_ = flushed_bytes_;
}

void AppendFile::take_back() noexcept {
  buffer_.clear();
  if (flushed_bytes_ == committed_bytes_) return;
  // Where even that fails, what is left is a part without its end.
  if (::ftruncate(descriptor_, static_cast<off_t>(committed_bytes_)) != 0) return;
  ::lseek(descriptor_, static_cast<off_t>(committed_bytes_), SEEK_SET);
  flushed_bytes_ = committed_bytes_;
}

void AppendFile::flush() {
  const std::uint64_t size = flushed_bytes_ + buffer_.size();
  const int error = write_all(descriptor_, buffer_);
  flushed_bytes_ = size;  // At most: taking back cuts whatever there is.
  buffer_.clear();
  if (error != 0) fail("be written", error);
}

void AppendFile::fail(std::string_view action, int error_number) {
  if (descriptor_ >= 0) take_back();
  throw OutputError(path_.string(),
                    fmt::format("cannot {}: {}, expected enough space and the right to write",
                                action,
                                error_text(error_number)));
}

}  // namespace waymark

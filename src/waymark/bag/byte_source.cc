// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/bag/byte_source.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>

#include "waymark/base/check.h"

namespace waymark {
namespace {

/// Small messages are read many at once; of large ones only the start is looked at.
constexpr std::size_t kReadAhead = 16384;

}  // namespace

FileSource::FileSource(const std::filesystem::path& path)
    // A pipe is not waited for, but refused below.
    : descriptor_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
  struct stat status = {};
  if (descriptor_ < 0 || ::fstat(descriptor_, &status) != 0 || !S_ISREG(status.st_mode)) {
    if (descriptor_ >= 0) ::close(descriptor_);
    throw InputError(path.string(), "cannot be read, expected a file and the right to read it");
  }
  size_ = static_cast<std::uint64_t>(status.st_size);
}

FileSource::~FileSource() { ::close(descriptor_); }

std::string_view FileSource::peek(std::uint64_t offset, std::size_t count) {
  if (offset >= size_) return {};
  const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(count, size_ - offset));
  const bool is_there =
      offset >= buffer_offset_ && offset + wanted <= buffer_offset_ + buffer_.size();
  if (!is_there) {
    const std::uint64_t ahead =
        std::min<std::uint64_t>(std::max(wanted, kReadAhead), size_ - offset);
    buffer_.resize(static_cast<std::size_t>(ahead));
    buffer_offset_ = offset;
    std::size_t num_read = 0;
    while (num_read < buffer_.size()) {
      const ssize_t step = ::pread(descriptor_,
                                   buffer_.data() + num_read,
                                   buffer_.size() - num_read,
                                   static_cast<off_t>(offset + num_read));
      if (step <= 0) break;
      num_read += static_cast<std::size_t>(step);
    }
    buffer_.resize(num_read);
  }
  return std::string_view(buffer_).substr(static_cast<std::size_t>(offset - buffer_offset_),
                                          wanted);
}

}  // namespace waymark

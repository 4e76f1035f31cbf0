// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace waymark {

/// A file that grows by parts. What was written since the last commit() is on the disk after the
/// next one, or is taken back: by a failure (disk full, file size limit), which is an OutputError,
/// or the destructor. Whoever kills the program may leave the beginning of a part.
class AppendFile {
 public:
  /// Makes an empty file in place of what was there.
  explicit AppendFile(std::filesystem::path path);
  ~AppendFile();
  AppendFile(const AppendFile&) = delete;
  AppendFile& operator=(const AppendFile&) = delete;

  void write(std::string_view bytes);
  /// Puts what was written on the disk, for good.
  void commit();
  /// Takes back what was written since the last commit().
  void take_back() noexcept;
  /// In bytes, up to the last commit().
  std::uint64_t size() const { return committed_bytes_; }

 private:
  void flush();
  [[noreturn]] void fail(std::string_view action, int error_number);

  const std::filesystem::path path_;
  std::string buffer_;
  std::uint64_t committed_bytes_ = 0;
  std::uint64_t flushed_bytes_ = 0;
  int descriptor_ = -1;
};

}  // namespace waymark

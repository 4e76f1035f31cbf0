// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>

namespace waymark {

/// A file that appears under its name complete or not at all. It grows in a temporary file of the
/// same folder, which commit() flushes to the disk and renames; without commit() the destructor
/// removes it. Every failure (no folder, disk full, file size limit) is an OutputError, after which
/// nothing is left behind.
class AtomicFile {
 public:
  explicit AtomicFile(const std::filesystem::path& path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(std::string_view bytes);
  /// Puts the file under its final name, replacing what was there. Once, after the last write().
  void commit();

 private:
  void flush();
  void discard() noexcept;
  [[noreturn]] void fail(std::string_view action, int error_number);

  std::filesystem::path path_;
  std::filesystem::path temporary_;
  std::string buffer_;
  int descriptor_ = -1;
};

/// Writes the whole content; throws OutputError like AtomicFile.
void write_file_atomically(const std::filesystem::path& path, std::string_view content);

/// Calls all of them, whatever became of those before, so that what can be saved is. Then throws
/// what failed: the exception itself or, of several, an OutputError with all of the messages.
void save_each(std::initializer_list<std::function<void()>> saves);

/// Removes what programs that were killed while they wrote this file left beside it. What a living
/// program writes stays.
void remove_abandoned_parts(const std::filesystem::path& path);

/// Puts the names in a folder on the disk, where its file system can.
void flush_folder(const std::filesystem::path& folder);

/// Makes the folder and those above it; throws OutputError when that fails or a file is in the way.
void make_output_folder(const std::filesystem::path& folder);

}  // namespace waymark

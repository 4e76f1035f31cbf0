// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace waymark {

/// Bytes that are read piece by piece.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  virtual std::uint64_t size() const = 0;
  /// Those bytes, less where the source ends before; valid until the next call.
  virtual std::string_view peek(std::uint64_t offset, std::size_t count) = 0;
};

/// Bytes in memory, which must outlive it.
class MemorySource : public ByteSource {
 public:
  explicit MemorySource(std::string_view bytes) : bytes_(bytes) {}
  std::uint64_t size() const override { return bytes_.size(); }
  std::string_view peek(std::uint64_t offset, std::size_t count) override {
    return offset < bytes_.size() ? bytes_.substr(offset, count) : std::string_view();
  }

 private:
  std::string_view bytes_;
};

/// A file as it is when it is opened: what is added later is not seen, what is cut off is missing.
class FileSource : public ByteSource {
 public:
  /// Throws InputError for a file that cannot be read.
  explicit FileSource(const std::filesystem::path& path);
  ~FileSource() override;
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;

  std::uint64_t size() const override { return size_; }
  std::string_view peek(std::uint64_t offset, std::size_t count) override;

 private:
  int descriptor_;
  std::uint64_t size_ = 0;
  std::string buffer_;
  std::uint64_t buffer_offset_ = 0;
};

/// Reads numbers and strings in order from bytes that came from outside, least significant byte
/// first. What is not there reads as 0 or empty and is remembered.
class FieldReader {
 public:
  explicit FieldReader(std::string_view bytes) : rest_(bytes) {}

  template <class Number>
  Number number() {
    const std::string_view bytes = take(sizeof(Number));
    std::uint64_t value = 0;
    for (std::size_t i = bytes.size(); i > 0; --i) {
      value = value << 8 | static_cast<unsigned char>(bytes[i - 1]);
    }
    return static_cast<Number>(value);
  }

  /// The next bytes, if there are so many.
  std::string_view take(std::uint64_t count) {
    if (count > rest_.size()) {
      has_failed_ = true;
      rest_ = {};
      return {};
    }
    const std::string_view taken = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return taken;
  }

  /// A string after its length in 32 bits.
  std::string_view string() { return take(number<std::uint32_t>()); }

  std::string_view rest() const { return rest_; }
  bool has_failed() const { return has_failed_; }

 private:
  std::string_view rest_;
  bool has_failed_ = false;
};

}  // namespace waymark

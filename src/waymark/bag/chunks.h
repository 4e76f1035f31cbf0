// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/bag/bag.h"
#include "waymark/bag/byte_source.h"
#include "waymark/bag/decompress.h"

namespace waymark {

/// A compressed piece of a file.
struct Chunk {
  Compression compression = Compression::kNone;
  std::uint64_t offset = 0;       ///< Of its first byte in the file.
  std::uint64_t stored_size = 0;  ///< Bytes in the file.
  std::uint64_t size = 0;         ///< Bytes of the content, as stated.
};

/// A file with messages in compressed chunks, or in itself.
class ChunkedFile : public BagFile {
 public:
  explicit ChunkedFile(const std::filesystem::path& path)
      : path_(path), source_(path), num_bytes_left_(kBytesOfAny + kMaxRatio * source_.size()) {}

  FileSource& source() { return source_; }
  std::string name() const { return path_.string(); }

  /// The content of a chunk, nothing if it is damaged or if all that was decompressed were too much
  /// for a file of this size.
  std::optional<std::string> decompress(const Chunk& chunk);
  /// Keeps a chunk whose messages are listed; its index in their places.
  std::uint32_t keep(const Chunk& chunk);

  std::string read(const BagPlace& place) override;

 private:
  const std::string& content_of(std::uint32_t chunk);

  /// Images are compressed to a half; what is black, to a hundredth and less.
  static constexpr std::uint64_t kMaxRatio = 200;
  static constexpr std::uint64_t kBytesOfAny = std::uint64_t{256} << 20;
  /// The two images of a moment may be in neighbouring chunks.
  static constexpr std::size_t kNumOpen = 2;
  struct OpenChunk {
    std::uint32_t index = kNoChunk;
    std::string content;
  };

  std::filesystem::path path_;
  FileSource source_;
  std::uint64_t num_bytes_left_;  ///< To decompress.
  std::vector<Chunk> chunks_;
  std::vector<OpenChunk> open_;  ///< At most kNumOpen, the one used last in front.
};

/// Says where a file ends before it should, as a line among the faults.
std::string describe_cut_off(const std::string& name, std::uint64_t offset);
/// Says how many chunks of a file could not be read; empty for none.
std::string describe_bad_chunks(const std::string& name, std::size_t num_bad);

}  // namespace waymark

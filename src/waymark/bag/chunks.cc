// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/bag/chunks.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "waymark/base/check.h"

namespace waymark {

std::optional<std::string> ChunkedFile::decompress(const Chunk& chunk) {
  if (chunk.stored_size > kMaxChunkBytes || chunk.size > num_bytes_left_) return std::nullopt;
  const std::string_view stored =
      source_.peek(chunk.offset, static_cast<std::size_t>(chunk.stored_size));
  if (stored.size() != chunk.stored_size) return std::nullopt;
  num_bytes_left_ -= chunk.size;
  return waymark::decompress(chunk.compression, stored, chunk.size);
}

std::uint32_t ChunkedFile::keep(const Chunk& chunk) {
  chunks_.push_back(chunk);
  return static_cast<std::uint32_t>(chunks_.size() - 1);
}

const std::string& ChunkedFile::content_of(std::uint32_t chunk) {
  const auto found = std::ranges::find(open_, chunk, &OpenChunk::index);
  if (found != open_.end()) {
    std::rotate(open_.begin(), found, found + 1);
    return open_.front().content;
  }
  std::optional<std::string> content = decompress(chunks_.at(chunk));
  if (!content) throw InputError(name(), "a chunk cannot be decompressed any more");
  if (open_.size() == kNumOpen) open_.pop_back();
  open_.insert(open_.begin(), OpenChunk{chunk, *std::move(content)});
  return open_.front().content;
}

std::string ChunkedFile::read(const BagPlace& place) {
  const auto size = static_cast<std::size_t>(place.size);
  std::string_view bytes;
  if (place.chunk == kNoChunk) {
    bytes = source_.peek(place.offset, size);
  } else {
    bytes = MemorySource(content_of(place.chunk)).peek(place.offset, size);
  }
  if (bytes.size() != size) throw InputError(name(), "is shorter than when it was opened");
  return std::string(bytes);
}

std::string describe_cut_off(const std::string& name, std::uint64_t offset) {
  return fmt::format(
      "{}: cut off or damaged after {} bytes: what comes before is used", name, offset);
}

std::string describe_bad_chunks(const std::string& name, std::size_t num_bad) {
  return num_bad == 0 ? "" : fmt::format("{}: {} damaged chunks are left out", name, num_bad);
}

}  // namespace waymark

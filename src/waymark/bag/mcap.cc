// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "waymark/bag/bag.h"
#include "waymark/bag/chunks.h"
#include "waymark/base/check.h"
#include "waymark/base/crc32.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

constexpr std::string_view kMcapMagic("\x89MCAP0\r\n", 8);
constexpr std::uint64_t kMcapRecordStart = 9;  ///< Opcode and length.
constexpr std::uint64_t kMcapMessageStart = 22;
/// Of a schema or a channel, of which the beginning is read.
constexpr std::uint64_t kMaxMcapDescription = std::uint64_t{1} << 20;
constexpr std::uint64_t kMcapChunkStart = 28;  ///< Times, size and checksum.

enum McapOpcode : std::uint8_t {
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kDataEnd = 0x0F,
};

struct McapRecord {
  std::uint8_t opcode = 0;
  std::uint64_t offset = 0;  ///< Of its content.
  std::uint64_t size = 0;    ///< Of its content.
};

std::optional<Compression> compression_of(std::string_view name) {
  if (name.empty()) return Compression::kNone;
  if (name == "lz4") return Compression::kLz4;
  if (name == "zstd") return Compression::kZstd;
  return std::nullopt;
}

/// Reads the records of a file in order, and those of its chunks.
class McapScanner {
 public:
  McapScanner(ChunkedFile& file, std::uint32_t file_index, BagContent& content)
      : file_(file), file_index_(file_index), content_(content) {}

  void scan() {
    const std::uint64_t end = walk({file_.source()}, kMcapMagic.size(), file_.source().size());
    if (!is_closed_) content_.faults.push_back(describe_cut_off(file_.name(), end));
    if (num_bad_chunks_ > 0)
      content_.faults.push_back(describe_bad_chunks(file_.name(), num_bad_chunks_));
  }

 private:
  /// Where records are: in the file, or in a chunk of it.
  struct Region {
    ByteSource& source;
    bool is_chunk = false;
    std::uint32_t chunk = kNoChunk;  ///< Of the compressed ones.
  };

  /// Takes what is whole from begin on; gives where that ends.
  std::uint64_t walk(const Region& region, std::uint64_t begin, std::uint64_t end) {
    std::uint64_t offset = begin;
    while (offset + kMcapRecordStart <= end) {
      FieldReader reader(region.source.peek(offset, kMcapRecordStart));
      const auto opcode = reader.number<std::uint8_t>();
      const auto size = reader.number<std::uint64_t>();
      const McapRecord record{opcode, offset + kMcapRecordStart, size};
      const bool is_whole = !reader.has_failed() && size <= end - record.offset;
      if (opcode == kChunk && !region.is_chunk && !is_whole) take_part_of_chunk(record, end);
      if (opcode == 0 || !is_whole) return offset;
      if (!region.is_chunk && (opcode == kDataEnd || opcode == kFooter)) {
        is_closed_ = true;
        return record.offset + size;
      }
      take(region, record);
      offset = record.offset + size;
    }
    return offset;
  }

  void take(const Region& region, const McapRecord& record) {
    switch (record.opcode) {
      case kSchema:
        return take_schema(region.source, record);
      case kChannel:
        return take_channel(region.source, record);
      case kMessage:
        return take_message(region, record);
      case kChunk:
        if (!region.is_chunk && !take_chunk(record)) ++num_bad_chunks_;
        return;
      default:
        return;
    }
  }

  void take_schema(ByteSource& source, const McapRecord& record) {
    FieldReader reader(description(source, record));
    const auto id = reader.number<std::uint16_t>();
    schemas_[id] = std::string(reader.string());
  }

  void take_channel(ByteSource& source, const McapRecord& record) {
    FieldReader reader(description(source, record));
    const auto id = reader.number<std::uint16_t>();
    const auto schema = reader.number<std::uint16_t>();
    const std::string_view topic = reader.string();
    const std::string_view encoding = reader.string();
    if (reader.has_failed()) return;
    const auto type = schemas_.find(schema);
    channels_[id] = content_.topic_of(topic,
                                      type == schemas_.end() ? "" : std::string_view(type->second),
                                      encoding == "cdr"    ? RosEncoding::kCdr
                                      : encoding == "ros1" ? RosEncoding::kRos1
                                                           : RosEncoding::kUnknown);
  }

  void take_message(const Region& region, const McapRecord& record) {
    if (record.size < kMcapMessageStart) return;
    FieldReader reader(region.source.peek(record.offset, kMcapMessageStart));
    const auto channel = channels_.find(reader.number<std::uint16_t>());
    reader.take(4);  // Sequence number.
    const auto recorded_ns = static_cast<std::int64_t>(reader.number<std::uint64_t>());
    reader.take(8);  // When it was published.
    if (channel == channels_.end()) return;
    const BagPlace place{file_index_,
                         region.chunk,
                         record.offset + kMcapMessageStart,
                         record.size - kMcapMessageStart};
    const std::size_t num_start = content_.topics[channel->second].num_start_bytes();
    content_.add(channel->second,
                 recorded_ns,
                 place,
                 region.source.peek(place.offset, std::min<std::uint64_t>(place.size, num_start)));
  }

  /// False if it is damaged.
  bool take_chunk(const McapRecord& record) {
    const std::optional<ChunkStart> start = read_start(record, record.offset + record.size);
    if (!start) return false;
    const Chunk& chunk = start->chunk;
    if (chunk.offset + chunk.stored_size > record.offset + record.size) return false;
    if (chunk.compression == Compression::kNone) {
      walk({file_.source(), true}, chunk.offset, chunk.offset + chunk.stored_size);
      return true;
    }
    const std::optional<std::string> content = file_.decompress(chunk);
    if (!content || (start->checksum != 0 && crc32(*content) != start->checksum)) return false;
    MemorySource source(*content);
    walk({source, true, file_.keep(chunk)}, 0, content->size());
    return true;
  }

  /// What is there of a chunk beyond the end of the file, if it is not compressed.
  void take_part_of_chunk(const McapRecord& record, std::uint64_t end) {
    const std::optional<ChunkStart> start = read_start(record, end);
    if (!start || start->chunk.compression != Compression::kNone) return;
    walk({file_.source(), true}, start->chunk.offset, end);
  }

  struct ChunkStart {
    Chunk chunk;
    std::uint32_t checksum = 0;
  };

  std::optional<ChunkStart> read_start(const McapRecord& record, std::uint64_t end) {
    constexpr std::size_t kLongestName = 32;
    constexpr std::size_t kLongest = kMcapChunkStart + 4 + kLongestName + 8;
    const std::uint64_t available = std::min<std::uint64_t>(kLongest, end - record.offset);
    const std::string_view bytes =
        file_.source().peek(record.offset, static_cast<std::size_t>(available));
    FieldReader reader(bytes);
    reader.take(16);  // First and last time.
    ChunkStart start;
    start.chunk.size = reader.number<std::uint64_t>();
    start.checksum = reader.number<std::uint32_t>();
    const std::string_view name = reader.string();
    start.chunk.stored_size = reader.number<std::uint64_t>();
    if (reader.has_failed() || start.chunk.stored_size > file_.source().size()) return std::nullopt;
    const std::optional<Compression> compression = compression_of(name);
    if (!compression) {
      throw InputError(file_.name(),
                       fmt::format("chunks are compressed by {}, expected lz4, zstd or nothing",
                                   quote_for_message(name)));
    }
    start.chunk.compression = *compression;
    start.chunk.offset = record.offset + (bytes.size() - reader.rest().size());
    return start;
  }

  /// A schema has its definition in the end, which is not needed.
  std::string_view description(ByteSource& source, const McapRecord& record) {
    const std::uint64_t size = std::min(record.size, kMaxMcapDescription);
    return source.peek(record.offset, static_cast<std::size_t>(size));
  }

  ChunkedFile& file_;
  std::uint32_t file_index_;
  BagContent& content_;
  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, std::uint32_t> channels_;
  std::size_t num_bad_chunks_ = 0;
  bool is_closed_ = false;
};

}  // namespace

std::unique_ptr<BagFile> scan_mcap(const std::filesystem::path& path,
                                   std::uint32_t file,
                                   BagContent& content) {
  auto opened = std::make_unique<ChunkedFile>(path);
  if (opened->source().peek(0, kMcapMagic.size()) != kMcapMagic) {
    throw InputError(path.string(), "does not begin as MCAP of version 0 does");
  }
  McapScanner(*opened, file, content).scan();
  return opened;
}

}  // namespace waymark

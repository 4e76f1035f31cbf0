// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "waymark/bag/bag.h"
#include "waymark/bag/chunks.h"
#include "waymark/base/check.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

constexpr std::string_view kRos1Magic = "#ROSBAG V2.0\n";
/// Headers have a few short fields. A connection's data have the definition of its messages.
constexpr std::uint32_t kMaxRos1Header = 65536;
constexpr std::uint32_t kMaxRos1Connection = std::uint32_t{1} << 24;

enum Ros1Op : std::uint8_t {
  kMessageData = 0x02,
  kBagHeader = 0x03,
  kChunkOp = 0x05,
  kConnection = 0x07,
};

/// The fields "name=value" of a header.
std::map<std::string, std::string, std::less<>> fields_of(std::string_view bytes) {
  std::map<std::string, std::string, std::less<>> fields;
  FieldReader reader(bytes);
  while (!reader.rest().empty()) {
    const std::string_view field = reader.string();
    const std::size_t equals = field.find('=');
    if (reader.has_failed() || equals == std::string_view::npos) break;
    fields.emplace(field.substr(0, equals), field.substr(equals + 1));
  }
  return fields;
}

struct Ros1Record {
  std::map<std::string, std::string, std::less<>> fields;
  std::uint64_t offset = 0;  ///< Of its data.
  std::uint64_t size = 0;    ///< Of its data, as stated.

  std::string_view text(std::string_view name) const {
    const auto found = fields.find(name);
    return found == fields.end() ? std::string_view() : std::string_view(found->second);
  }
  /// Nothing where there is none of this size.
  template <class Number>
  std::optional<Number> number(std::string_view name) const {
    if (text(name).size() != sizeof(Number)) return std::nullopt;
    return FieldReader(text(name)).number<Number>();
  }
  std::uint8_t op() const { return number<std::uint8_t>("op").value_or(0); }
};

/// Reads the records of a file in order, and those of its chunks.
class Ros1Scanner {
 public:
  Ros1Scanner(ChunkedFile& file, std::uint32_t file_index, BagContent& content)
      : file_(file), file_index_(file_index), content_(content) {}

  void scan() {
    const std::uint64_t size = file_.source().size();
    const std::uint64_t end = walk({file_.source()}, kRos1Magic.size(), size);
    if (end < size || !is_indexed_) content_.faults.push_back(describe_cut_off(file_.name(), end));
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
    while (offset < end) {
      const std::optional<Ros1Record> record = read_record(region.source, offset, end);
      if (!record || record->op() == 0) return offset;
      const bool is_whole = record->size <= end - record->offset;
      if (!is_whole && record->op() == kChunkOp && !region.is_chunk) take_chunk(*record, end);
      if (!is_whole) return offset;
      take(region, *record);
      offset = record->offset + record->size;
    }
    return offset;
  }

  static std::optional<Ros1Record> read_record(ByteSource& source,
                                               std::uint64_t offset,
                                               std::uint64_t end) {
    const auto length_at = [&](std::uint64_t at) -> std::optional<std::uint32_t> {
      if (at + 4 > end) return std::nullopt;
      FieldReader reader(source.peek(at, 4));
      const auto length = reader.number<std::uint32_t>();
      return reader.has_failed() ? std::nullopt : std::optional(length);
    };
    const std::optional<std::uint32_t> header_size = length_at(offset);
    if (!header_size || *header_size > kMaxRos1Header) return std::nullopt;
    const std::optional<std::uint32_t> data_size = length_at(offset + 4 + *header_size);
    if (!data_size) return std::nullopt;
    return Ros1Record{
        fields_of(source.peek(offset + 4, *header_size)), offset + 8 + *header_size, *data_size};
  }

  void take(const Region& region, const Ros1Record& record) {
    switch (record.op()) {
      case kBagHeader:
        return take_bag_header(record);
      case kConnection:
        return take_connection(region.source, record);
      case kMessageData:
        return take_message(region, record);
      case kChunkOp:
        if (!region.is_chunk && !take_chunk(record, record.offset + record.size)) ++num_bad_chunks_;
        return;
      default:
        return;
    }
  }

  /// A bag that was not closed has no place of its index.
  void take_bag_header(const Ros1Record& record) {
    is_indexed_ = record.number<std::uint64_t>("index_pos").value_or(0) > 0;
    if (record.text("encryptor").empty()) return;
    throw InputError(file_.name(), "is encrypted, expected a bag that is not");
  }

  void take_connection(ByteSource& source, const Ros1Record& record) {
    const auto id = record.number<std::uint32_t>("conn");
    if (!id || record.size > kMaxRos1Connection) return;
    const auto connection =
        fields_of(source.peek(record.offset, static_cast<std::size_t>(record.size)));
    const auto type = connection.find("type");
    if (type == connection.end()) return;
    connections_[*id] = content_.topic_of(record.text("topic"), type->second, RosEncoding::kRos1);
  }

  void take_message(const Region& region, const Ros1Record& record) {
    const auto id = record.number<std::uint32_t>("conn");
    const auto connection = connections_.find(id.value_or(UINT32_MAX));
    FieldReader time(record.text("time"));
    const auto seconds = time.number<std::uint32_t>();
    const auto nanoseconds = time.number<std::uint32_t>();
    if (connection == connections_.end() || time.has_failed()) return;
    const std::size_t num_start = content_.topics[connection->second].num_start_bytes();
    const std::size_t size = std::min<std::uint64_t>(record.size, num_start);
    content_.add(connection->second,
                 std::int64_t{seconds} * 1'000'000'000 + nanoseconds,
                 {file_index_, region.chunk, record.offset, record.size},
                 region.source.peek(record.offset, size));
  }

  /// Takes a chunk, whose data end at `end` at the latest; false if it is damaged.
  bool take_chunk(const Ros1Record& record, std::uint64_t end) {
    const std::string_view name = record.text("compression");
    if (name == "none") {
      walk({file_.source(), true}, record.offset, std::min(end, record.offset + record.size));
      return true;
    }
    if (name != "lz4" && name != "bz2") {
      throw InputError(file_.name(),
                       fmt::format("chunks are compressed by {}, expected none, bz2 or lz4",
                                   quote_for_message(name)));
    }
    const auto size = record.number<std::uint32_t>("size");
    const Compression compression = name == "lz4" ? Compression::kLz4 : Compression::kBz2;
    const Chunk chunk{compression, record.offset, record.size, size.value_or(0)};
    if (!size || record.offset + record.size > end) return false;
    const std::optional<std::string> content = file_.decompress(chunk);
    if (!content) return false;
    MemorySource source(*content);
    walk({source, true, file_.keep(chunk)}, 0, content->size());
    return true;
  }

  ChunkedFile& file_;
  std::uint32_t file_index_;
  BagContent& content_;
  std::map<std::uint32_t, std::uint32_t> connections_;
  std::size_t num_bad_chunks_ = 0;
  bool is_indexed_ = false;
};

}  // namespace

std::unique_ptr<BagFile> scan_ros1_bag(const std::filesystem::path& path,
                                       std::uint32_t file,
                                       BagContent& content) {
  auto opened = std::make_unique<ChunkedFile>(path);
  if (opened->source().peek(0, kRos1Magic.size()) != kRos1Magic) {
    throw InputError(path.string(), "does not begin as a bag of ROS 1 of format 2.0 does");
  }
  Ros1Scanner(*opened, file, content).scan();
  return opened;
}

}  // namespace waymark

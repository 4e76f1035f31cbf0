// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <map>

#include "waymark/bag/bag.h"
#include "waymark/bag/sqlite_file.h"
#include "waymark/base/check.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

std::string_view text_of(sqlite3_stmt* row, int column) {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(row, column));
  if (text == nullptr) return {};
  return {text, static_cast<std::size_t>(sqlite3_column_bytes(row, column))};
}

struct CloseBlob {
  void operator()(sqlite3_blob* blob) const { sqlite3_blob_close(blob); }
};
using Blob = std::unique_ptr<sqlite3_blob, CloseBlob>;

class SqliteBag : public BagFile {
 public:
  explicit SqliteBag(const std::filesystem::path& path) : path_(path) {
    base_ = open_sqlite(path, "messages");
    if (!base_) {
      throw InputError(path.string(),
                       "cannot be read as a bag of ROS 2, expected a data base with "
                       "the tables topics and messages");
    }
  }

  void scan(std::uint32_t file, BagContent& content) {
    const std::map<std::int64_t, std::uint32_t> topics = read_topics(content);
    const SqliteStatement rows =
        prepare_sqlite(base_.get(), "SELECT rowid, topic_id, timestamp FROM messages NOT INDEXED");
    std::size_t num_bad = 0;
    int status = SQLITE_ERROR;
    SqliteRowOrder order;
    while (rows && (status = sqlite3_step(rows.get())) == SQLITE_ROW && order.take(rows.get())) {
      const auto topic = topics.find(sqlite3_column_int64(rows.get(), 1));
      if (topic == topics.end()) continue;
      const std::int64_t row = sqlite3_column_int64(rows.get(), 0);
      const std::int64_t recorded_ns = sqlite3_column_int64(rows.get(), 2);
      BagPlace place{file, kNoChunk, static_cast<std::uint64_t>(row), 0};
      std::string start;
      const BagTopic& of = content.topics[topic->second];
      if (of.is_listed() || of.is_imu()) {
        sqlite3_blob* blob = open_blob(row);
        place.size = blob ? static_cast<std::uint64_t>(sqlite3_blob_bytes(blob)) : 0;
        start.resize(std::min<std::uint64_t>(place.size, of.num_start_bytes()));
        const bool is_good =
            blob &&
            sqlite3_blob_read(blob, start.data(), static_cast<int>(start.size()), 0) == SQLITE_OK;
        if (!is_good) {
          ++num_bad;
          continue;
        }
      }
      content.add(topic->second, recorded_ns, place, start);
    }
    if (num_bad > 0) {
      content.faults.push_back(
          fmt::format("{}: {} damaged messages are left out", path_.string(), num_bad));
    }
    if (status != SQLITE_DONE) {
      content.faults.push_back(
          fmt::format("{}: cut off or damaged: what comes before is used", path_.string()));
    }
  }

  std::string read(const BagPlace& place) override {
    sqlite3_blob* blob = open_blob(static_cast<std::int64_t>(place.offset));
    std::string bytes;
    if (blob && static_cast<std::uint64_t>(sqlite3_blob_bytes(blob)) == place.size) {
      bytes.resize(static_cast<std::size_t>(place.size));
      const int status = sqlite3_blob_read(blob, bytes.data(), static_cast<int>(bytes.size()), 0);
      if (status == SQLITE_OK) return bytes;
    }
    throw InputError(path_.string(), "a message is damaged");
  }

 private:
  std::map<std::int64_t, std::uint32_t> read_topics(BagContent& content) {
    std::map<std::int64_t, std::uint32_t> topics;
    const SqliteStatement rows = prepare_sqlite(
        base_.get(), "SELECT rowid, name, type, serialization_format FROM topics NOT INDEXED");
    SqliteRowOrder order;
    while (rows && sqlite3_step(rows.get()) == SQLITE_ROW && order.take(rows.get())) {
      const RosEncoding encoding =
          text_of(rows.get(), 3) == "cdr" ? RosEncoding::kCdr : RosEncoding::kUnknown;
      topics[sqlite3_column_int64(rows.get(), 0)] =
          content.topic_of(text_of(rows.get(), 1), text_of(rows.get(), 2), encoding);
    }
    return topics;
  }

  /// The message of a row, null where it cannot be read. Of its pages only those that are asked for
  /// are read.
  sqlite3_blob* open_blob(std::int64_t row) {
    if (blob_ && sqlite3_blob_reopen(blob_.get(), row) == SQLITE_OK) return blob_.get();
    blob_.reset();
    sqlite3_blob* opened = nullptr;
    const int status =
        sqlite3_blob_open(base_.get(), "main", "messages", "data", row, /*flags=*/0, &opened);
    blob_.reset(opened);
    return status == SQLITE_OK ? opened : nullptr;
  }

  std::filesystem::path path_;
  SqliteDatabase base_;
  Blob blob_;  ///< After base_, as it has to be closed before it.
};

}  // namespace

std::unique_ptr<BagFile> scan_sqlite_bag(const std::filesystem::path& path,
                                         std::uint32_t file,
                                         BagContent& content) {
  auto opened = std::make_unique<SqliteBag>(path);
  opened->scan(file, content);
  return opened;
}

}  // namespace waymark

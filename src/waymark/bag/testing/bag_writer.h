// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bzlib.h>
#include <lz4frame.h>
#include <sqlite3.h>
#include <zstd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/bag/decompress.h"
#include "waymark/bag/testing/message_writer.h"
#include "waymark/base/check.h"
#include "waymark/base/crc32.h"

namespace waymark::testing {

/// A message to write.
struct WrittenMessage {
  std::string topic;
  std::string type;  ///< As ROS 1 has it.
  std::int64_t recorded_ns = 0;
  std::string bytes;
};

inline std::string compress(Compression compression, const std::string& bytes) {
  std::string packed;
  if (compression == Compression::kLz4) {
    packed.resize(LZ4F_compressFrameBound(bytes.size(), nullptr));
    packed.resize(
        LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), nullptr));
    return packed;
  }
  if (compression == Compression::kZstd) {
    packed.resize(ZSTD_compressBound(bytes.size()));
    packed.resize(
        ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), /*level=*/1));
    return packed;
  }
  if (compression == Compression::kNone) return bytes;
  packed.resize(bytes.size() + bytes.size() / 100 + 600);
  auto size = static_cast<unsigned>(packed.size());
  WAYMARK_CHECK(BZ2_bzBuffToBuffCompress(packed.data(),
                                         &size,
                                         const_cast<char*>(bytes.data()),
                                         static_cast<unsigned>(bytes.size()),
                                         9,
                                         0,
                                         0) == BZ_OK);
  packed.resize(size);
  return packed;
}

inline std::string ros2_type(std::string type) { return type.replace(type.find('/'), 1, "/msg/"); }

inline void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

/// Calls write(first, last) for so many messages at a time.
template <class Write>
void for_each_chunk(const std::vector<WrittenMessage>& messages, std::size_t count, Write write) {
  for (std::size_t i = 0; i < messages.size(); i += count) {
    write(messages.begin() + static_cast<std::ptrdiff_t>(i),
          messages.begin() + static_cast<std::ptrdiff_t>(std::min(messages.size(), i + count)));
  }
}

/// A record of MCAP.
inline std::string mcap_record(int opcode, const std::string& content) {
  return static_cast<char>(opcode) + little(std::uint64_t{content.size()}) + content;
}

/// MCAP without an index; the topics are in the chunk in which they come first.
inline std::string make_mcap(const std::vector<WrittenMessage>& messages,
                             Compression compression = Compression::kNone,
                             std::size_t messages_per_chunk = 4) {
  std::string file("\x89MCAP0\r\n", 8);
  const std::string magic = file;
  file += mcap_record(1, counted("ros2") + counted("test"));
  std::map<std::string, std::uint16_t> channels;
  for_each_chunk(messages, messages_per_chunk, [&](auto first, auto last) {
    std::string records;
    for (auto message = first; message != last; ++message) {
      const auto next = static_cast<std::uint16_t>(channels.size() + 1);
      const auto [channel, is_new] = channels.emplace(message->topic, next);
      const std::string id = little(channel->second);
      if (is_new) {
        records += mcap_record(
            3,
            id + counted(ros2_type(message->type)) + counted("ros2msg") + counted("# definition"));
        records += mcap_record(
            4, id + id + counted(message->topic) + counted("cdr") + little(std::uint32_t{0}));
      }
      records += mcap_record(5,
                             id + little(std::uint32_t{1}) + little(message->recorded_ns) +
                                 little(message->recorded_ns) + message->bytes);
    }
    const std::string packed = compress(compression, records);
    const char* name = compression == Compression::kLz4    ? "lz4"
                       : compression == Compression::kZstd ? "zstd"
                                                           : "";
    file += mcap_record(6,
                        little(first->recorded_ns) + little((last - 1)->recorded_ns) +
                            little(std::uint64_t{records.size()}) + little(crc32(records)) +
                            counted(name) + little(std::uint64_t{packed.size()}) + packed);
  });
  file += mcap_record(0x0F, little(std::uint32_t{0}));
  file += mcap_record(
      2, little(std::uint64_t{0}) + little(std::uint64_t{0}) + little(std::uint32_t{0}));
  return file + magic;
}

/// A record of a bag of ROS 1.
inline std::string ros1_record(const std::vector<std::pair<std::string, std::string>>& fields,
                               const std::string& data) {
  std::string header;
  for (const auto& [name, value] : fields) header += counted(name + "=" + value);
  return counted(header) + counted(data);
}

/// A bag of ROS 1 without index records.
inline std::string make_ros1_bag(const std::vector<WrittenMessage>& messages,
                                 Compression compression = Compression::kNone,
                                 std::size_t messages_per_chunk = 4) {
  std::string file = "#ROSBAG V2.0\n";
  file += ros1_record({{"op", "\x03"},
                       {"index_pos", little(std::uint64_t{4117})},
                       {"conn_count", little(std::uint32_t{1})},
                       {"chunk_count", little(std::uint32_t{1})}},
                      std::string(4000, ' '));
  std::map<std::string, std::uint32_t> connections;
  for_each_chunk(messages, messages_per_chunk, [&](auto first, auto last) {
    std::string records;
    for (auto message = first; message != last; ++message) {
      const auto next = static_cast<std::uint32_t>(connections.size());
      const auto [connection, is_new] = connections.emplace(message->topic, next);
      const std::string id = little(connection->second);
      if (is_new) {
        const std::string data = counted("topic=" + message->topic) +
                                 counted("type=" + message->type) + counted("md5sum=0") +
                                 counted("message_definition=# a = b");
        records += ros1_record({{"op", "\x07"}, {"conn", id}, {"topic", message->topic}}, data);
      }
      const std::string time =
          little(static_cast<std::uint32_t>(message->recorded_ns / 1'000'000'000)) +
          little(static_cast<std::uint32_t>(message->recorded_ns % 1'000'000'000));
      records += ros1_record({{"op", "\x02"}, {"conn", id}, {"time", time}}, message->bytes);
    }
    const char* name = compression == Compression::kLz4   ? "lz4"
                       : compression == Compression::kBz2 ? "bz2"
                                                          : "none";
    file += ros1_record({{"op", "\x05"},
                         {"compression", name},
                         {"size", little(static_cast<std::uint32_t>(records.size()))}},
                        compress(compression, records));
  });
  return file;
}

/// The data base of a bag of ROS 2.
inline void write_sqlite_bag(const std::filesystem::path& path,
                             const std::vector<WrittenMessage>& messages) {
  sqlite3* base = nullptr;
  WAYMARK_CHECK(sqlite3_open(path.c_str(), &base) == SQLITE_OK);
  const auto run = [&](const std::string& query) {
    WAYMARK_CHECK(sqlite3_exec(base, query.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK);
  };
  run("CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,"
      "serialization_format TEXT NOT NULL,offered_qos_profiles TEXT NOT NULL);"
      "CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,"
      "timestamp INTEGER NOT NULL, data BLOB NOT NULL);BEGIN");
  std::map<std::string, std::size_t> topics;
  for (const WrittenMessage& message : messages) {
    const auto [topic, is_new] = topics.emplace(message.topic, topics.size() + 1);
    const std::string id = std::to_string(topic->second);
    if (is_new) {
      run("INSERT INTO topics VALUES(" + id + ",'" + message.topic + "','" +
          ros2_type(message.type) + "','cdr','')");
    }
    sqlite3_stmt* row = nullptr;
    const std::string query = "INSERT INTO messages(topic_id,timestamp,data) VALUES(" + id + "," +
                              std::to_string(message.recorded_ns) + ",?)";
    WAYMARK_CHECK(sqlite3_prepare_v2(base, query.c_str(), -1, &row, nullptr) == SQLITE_OK);
    sqlite3_bind_blob(
        row, 1, message.bytes.data(), static_cast<int>(message.bytes.size()), SQLITE_TRANSIENT);
    WAYMARK_CHECK(sqlite3_step(row) == SQLITE_DONE);
    sqlite3_finalize(row);
  }
  run("COMMIT");
  sqlite3_close(base);
}

}  // namespace waymark::testing

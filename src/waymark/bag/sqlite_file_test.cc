// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/bag/sqlite_file.h"

#include <gmock/gmock.h>

#include <fstream>

#include "waymark/bag/bag.h"
#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using testing::input_error_of;
using testing::TemporaryFolder;

constexpr const char* kTopics =
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);"
    "INSERT INTO topics VALUES(1, '/a', 'sensor_msgs/msg/Image', 'cdr');";
constexpr const char* kMessages =
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);"
    "INSERT INTO messages VALUES(1, 1, 5, x'00');";

std::filesystem::path make_base(const TemporaryFolder& folder, const std::string& statements) {
  const std::filesystem::path path = folder / "a.db3";
  std::filesystem::remove(path);
  sqlite3* base = nullptr;
  sqlite3_open(path.c_str(), &base);
  EXPECT_EQ(sqlite3_exec(base, statements.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
      << sqlite3_errmsg(base);
  sqlite3_close(base);
  return path;
}

TEST(SqliteFile, OfPlainTablesIsRead) {
  const TemporaryFolder folder;
  const auto path = make_base(
      folder,
      std::string(kTopics) + kMessages + "CREATE INDEX timestamp_idx ON messages (timestamp)");
  EXPECT_EQ(Bag(path).content().messages.size(), 1U);
  EXPECT_FALSE(open_sqlite(path, "others"));
}

TEST(SqliteFile, RunsNothingThatItDefines) {
  const TemporaryFolder folder;
  constexpr const char* kEndless =
      "WITH RECURSIVE r(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM r) SELECT n FROM r";
  const std::string with_tables = std::string(kTopics) + kMessages;
  const std::pair<std::string, const char*> definitions[] = {
      {std::string(kTopics) + "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER AS "
                              "(length(hex(zeroblob(900000000)))), timestamp INTEGER, data BLOB)",
       "generated column topic_id"},
      {std::string(kMessages) +
           "CREATE TABLE topics(id INTEGER PRIMARY KEY, type TEXT, serialization_format TEXT, "
           "name TEXT AS (printf('%.999999999d', 1)) STORED)",
       "generated column name"},
      {with_tables + "CREATE VIEW more AS " + kEndless, "view more"},
      {with_tables + "CREATE TRIGGER t AFTER INSERT ON topics BEGIN SELECT 1; END", "trigger t"},
      {with_tables + "CREATE INDEX i ON messages (length(hex(zeroblob(topic_id))))",
       "index of an expression i"},
      {with_tables + "CREATE INDEX i ON messages (topic_id) WHERE abs(topic_id) > 0",
       "partial index i"},
      {with_tables + "CREATE VIRTUAL TABLE v USING rtree(id, a, b)", "virtual table v"}};
  const auto view = make_base(folder, std::string(kTopics) + "CREATE VIEW messages AS " + kEndless);
  EXPECT_FALSE(open_sqlite(view, "messages"));
  for (const auto& [statements, found] : definitions) {
    const auto path = make_base(folder, statements);
    const std::string error = input_error_of([&] { Bag bag(path); });
    EXPECT_THAT(error, HasSubstr(found));
    EXPECT_THAT(error, HasSubstr("expected an SQLite data base of plain tables"));
  }
}

/// Work that a file asks for ends, however little its bytes.
TEST(SqliteFile, HasBounds) {
  const TemporaryFolder folder;
  const SqliteDatabase base =
      open_sqlite(make_base(folder, std::string(kTopics) + kMessages), "messages");
  EXPECT_FALSE(prepare_sqlite(base.get(), "SELECT randomblob(9)"));
  EXPECT_FALSE(prepare_sqlite(base.get(), "ATTACH '/tmp/x' AS x"));
  EXPECT_FALSE(
      prepare_sqlite(base.get(), ("SELECT 1" + std::string(200'000, ' ') + "+ 1").c_str()));
  sqlite3_set_authorizer(base.get(), nullptr, nullptr);
  const SqliteStatement endless = prepare_sqlite(
      base.get(),
      "WITH RECURSIVE r(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM r) SELECT max(n) FROM r");
  ASSERT_TRUE(endless);
  EXPECT_EQ(sqlite3_step(endless.get()), SQLITE_INTERRUPT);
}

/// SQLite would delete the file, for all that it knows.
TEST(SqliteFile, DeletesNothingThatAJournalNames) {
  const TemporaryFolder folder;
  const auto path = make_base(folder, std::string(kTopics) + kMessages);
  const auto other = folder / "other";
  std::ofstream(other) << "precious";
  const std::string magic = "\xd9\xd5\x05\xf9\x20\xa1\x63\xd7";
  const auto number = [](std::uint32_t value) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 255);
    return bytes;
  };
  const std::string name = other.string();
  std::uint32_t sum = 0;
  for (const char c : name) sum += static_cast<unsigned char>(c);
  std::string header = magic + std::string(8, '\0') + number(3) + number(512) + number(4096);
  header.resize(512);
  const std::string journal = path.string() + "-journal";
  std::ofstream(journal, std::ios::binary)
      << header << number(0x40000000 / 4096 + 1) << name
      << number(static_cast<std::uint32_t>(name.size())) << number(sum) << magic;
  for (const SqliteAccess access : {SqliteAccess::kRead, SqliteAccess::kWrite}) {
    EXPECT_THAT(input_error_of([&] { open_sqlite(path, "messages", access); }),
                HasSubstr("a.db3-journal: names another file"));
  }
  EXPECT_TRUE(std::filesystem::exists(other));
  // So it would be.
  sqlite3* base = nullptr;
  sqlite3_open(path.c_str(), &base);
  EXPECT_EQ(sqlite3_exec(base, "SELECT * FROM messages", nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(base);
  EXPECT_FALSE(std::filesystem::exists(other));
}

/// Thousands of definitions are no recording's.
TEST(SqliteFile, WithTooManyDefinitionsIsNotRead) {
  const TemporaryFolder folder;
  const std::string statements =
      std::string(kTopics) + kMessages +
      "PRAGMA writable_schema = ON; WITH RECURSIVE r(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM r "
      "LIMIT 8000) INSERT INTO sqlite_schema SELECT 'table', 't' || n, 't' || n, 2, 'CREATE TABLE "
      "t' || n || '(a)' FROM r";
  EXPECT_FALSE(open_sqlite(make_base(folder, statements), "messages"));
}

}  // namespace
}  // namespace waymark

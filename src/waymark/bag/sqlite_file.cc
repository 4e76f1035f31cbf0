// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/bag/sqlite_file.h"

#include <fmt/format.h>

namespace waymark {
namespace {

SqliteDatabase open_uri(const std::string& uri, const std::string& table) {
  sqlite3* opened = nullptr;
  const int status = sqlite3_open_v2(
      uri.c_str(), &opened, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
  SqliteDatabase base(opened);
  if (status != SQLITE_OK) return nullptr;
  for (const int option : {SQLITE_DBCONFIG_ENABLE_TRIGGER,
                           SQLITE_DBCONFIG_ENABLE_VIEW,
                           SQLITE_DBCONFIG_TRUSTED_SCHEMA}) {
    sqlite3_db_config(base.get(), option, 0, nullptr);
  }
  sqlite3_exec(base.get(), "PRAGMA cell_size_check=ON", nullptr, nullptr, nullptr);
  const std::string probe = fmt::format("SELECT 1 FROM {} LIMIT 1", table);
  const bool is_readable =
      sqlite3_exec(base.get(), probe.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK;
  return is_readable ? std::move(base) : nullptr;
}

/// A path in a URI of SQLite.
std::string uri_of(const std::filesystem::path& path) {
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(path).string()) {
    const bool is_special = c == '%' || c == '?' || c == '#';
    uri += is_special ? fmt::format("%{:02x}", static_cast<unsigned>(c)) : std::string(1, c);
  }
  return uri;
}

}  // namespace

SqliteDatabase open_sqlite(const std::filesystem::path& path, const std::string& table) {
  // What still stands in the journal of a program that did not end is read along, unless the folder
  // cannot be written, where such a journal cannot be used.
  SqliteDatabase base = open_uri(uri_of(path), table);
  return base ? std::move(base) : open_uri(uri_of(path) + "?immutable=1", table);
}

SqliteStatement prepare_sqlite(sqlite3* base, const char* query) {
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(base, query, -1, &statement, nullptr);
  return SqliteStatement(statement);
}

}  // namespace waymark

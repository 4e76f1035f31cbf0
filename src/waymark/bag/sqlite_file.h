// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

namespace waymark {

/// Ends what SQLite has opened.
struct CloseSqlite {
  void operator()(sqlite3* base) const { sqlite3_close_v2(base); }                 ///< A data base.
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }  ///< A query.

  std::shared_ptr<std::int64_t> num_steps_left = nullptr;  ///< Of a data base: what is left.
};
using SqliteDatabase = std::unique_ptr<sqlite3, CloseSqlite>;
using SqliteStatement = std::unique_ptr<sqlite3_stmt, CloseSqlite>;

enum class SqliteAccess { kRead, kWrite };

/// Opens a data base of somebody else's (sqlite.org/security.html): nothing that it defines is run,
/// no value is longer than its file, and work ends after so many steps as its size accounts for.
/// Null unless it is a regular file that can be read and has the table; InputError for one that
/// defines more than tables of values and indices of columns.
SqliteDatabase open_sqlite(const std::filesystem::path& path,
                           const std::string& table,
                           SqliteAccess access = SqliteAccess::kRead);

/// Null where the query does not fit the data base.
SqliteStatement prepare_sqlite(sqlite3* base, const char* query);

/// Rows come in the order of their ids. In a damaged file pages may refer to each other in a
/// circle, which has no end.
class SqliteRowOrder {
 public:
  /// False for a row, whose id is in column 0, that is not after the one before.
  bool take(sqlite3_stmt* row) {
    const std::int64_t id = sqlite3_column_int64(row, 0);
    const bool is_next = !last_ || id > *last_;
    last_ = id;
    return is_next;
  }

 private:
  std::optional<std::int64_t> last_;
};

}  // namespace waymark

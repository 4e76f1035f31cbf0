// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/bag/sqlite_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "waymark/base/check.h"
#include "waymark/base/regular_file.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// As sqlite.org/security.html advises for files of others.
constexpr struct {
  int limit;
  int value;
} kLimits[] = {
    {SQLITE_LIMIT_SQL_LENGTH, 100'000},
    {SQLITE_LIMIT_COLUMN, 100},
    {SQLITE_LIMIT_EXPR_DEPTH, 10},
    {SQLITE_LIMIT_COMPOUND_SELECT, 3},
    {SQLITE_LIMIT_VDBE_OP, 25'000},
    {SQLITE_LIMIT_FUNCTION_ARG, 8},
    {SQLITE_LIMIT_ATTACHED, 0},
    {SQLITE_LIMIT_LIKE_PATTERN_LENGTH, 50},
    {SQLITE_LIMIT_VARIABLE_NUMBER, 100},
    {SQLITE_LIMIT_TRIGGER_DEPTH, 1},
};
constexpr std::int64_t kLongestValue = 1'000'000'000;  // What SQLite allows by itself.
constexpr std::int64_t kLongestNewValue = 1 << 28;     // In a file that is written.
/// A row takes ten steps or so and has more bytes than that.
constexpr std::int64_t kStepsPerByte = 100;
constexpr std::int64_t kStepsOfAny = 10'000'000;
/// What it takes to look at thousands of definitions; those that programs write have ten or so.
constexpr std::int64_t kStepsOfOpening = 50'000;
constexpr int kStepsBetweenLooks = 1000;

int count_down(void* num_steps_left) {
  auto& left = *static_cast<std::int64_t*>(num_steps_left);
  left -= kStepsBetweenLooks;
  return left < 0 ? 1 : 0;
}

/// Statements read and write tables. What calls a function is none of ours.
int authorize(
    void* /*state*/, int action, const char*, const char*, const char*, const char* /*view*/) {
  switch (action) {
    case SQLITE_SELECT:
    case SQLITE_READ:
    case SQLITE_INSERT:
    case SQLITE_UPDATE:
    case SQLITE_DELETE:
    case SQLITE_PRAGMA:
    case SQLITE_TRANSACTION:
      return SQLITE_OK;
    default:
      return SQLITE_DENY;
  }
}

/// With what its journal adds; 0 where there is none.
std::int64_t num_bytes(const fs::path& path) {
  std::error_code error;
  std::int64_t sum = 0;
  for (const char* ending : {"", "-wal"}) {
    const std::uintmax_t size = fs::file_size(path.string() + ending, error);
    if (!error) sum += static_cast<std::int64_t>(size);
  }
  return sum;
}

/// The journal of a program that did not end may name another one (sqlite.org/fileformat2.html,
/// 3), which SQLite deletes, whatever file it is. None of a single data base does.
bool names_other_file(const fs::path& journal) {
  constexpr std::string_view kMagic = "\xd9\xd5\x05\xf9\x20\xa1\x63\xd7";
  std::error_code ignored;
  if (!fs::exists(journal, ignored)) return false;
  std::ifstream stream = open_regular_file(journal, "a journal of SQLite");
  std::string end(kMagic.size(), '\0');
  stream.seekg(-static_cast<std::streamoff>(end.size()), std::ios::end);
  return stream.read(end.data(), static_cast<std::streamsize>(end.size())) && end == kMagic;
}

SqliteDatabase open_uri(const std::string& uri, SqliteAccess access, std::int64_t size) {
  const bool is_writable = access == SqliteAccess::kWrite;
  sqlite3* opened = nullptr;
  const int status = sqlite3_open_v2(uri.c_str(),
                                     &opened,
                                     (is_writable ? SQLITE_OPEN_READWRITE : SQLITE_OPEN_READONLY) |
                                         SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX,
                                     nullptr);
  SqliteDatabase base(opened, {std::make_shared<std::int64_t>(kStepsOfOpening)});
  if (status != SQLITE_OK) return nullptr;
  sqlite3_db_config(opened, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  for (const int option : {SQLITE_DBCONFIG_ENABLE_TRIGGER,
                           SQLITE_DBCONFIG_ENABLE_VIEW,
                           SQLITE_DBCONFIG_TRUSTED_SCHEMA}) {
    sqlite3_db_config(opened, option, 0, nullptr);
  }
  for (const auto& [limit, value] : kLimits) sqlite3_limit(opened, limit, value);
  const std::int64_t longest = std::max(size, is_writable ? kLongestNewValue : 0);
  sqlite3_limit(opened, SQLITE_LIMIT_LENGTH, static_cast<int>(std::min(longest, kLongestValue)));
  sqlite3_progress_handler(
      opened, kStepsBetweenLooks, count_down, base.get_deleter().num_steps_left.get());
  sqlite3_busy_timeout(opened, 10'000);
  sqlite3_exec(opened, "PRAGMA cell_size_check=ON", nullptr, nullptr, nullptr);
  return base;
}

/// The first text of a query for definitions that are not to be there; nothing where it finds none.
std::optional<std::string> find_text(sqlite3* base, const char* query) {
  const SqliteStatement row = prepare_sqlite(base, query);
  const int status = row ? sqlite3_step(row.get()) : SQLITE_ERROR;
  if (status == SQLITE_DONE) return std::nullopt;
  const auto* text = reinterpret_cast<const char*>(
      status == SQLITE_ROW ? sqlite3_column_text(row.get(), 0) : nullptr);
  return text ? std::string(text) : "what cannot be read";
}

/// What a data base defines and would be run; nothing for plain tables and indices.
std::optional<std::string> find_definition(sqlite3* base) {
  constexpr const char* kQueries[] = {
      "SELECT iif(type = 'table', 'virtual table', type) || ' ' || name FROM sqlite_schema "
      "WHERE type NOT IN ('table', 'index') OR (type = 'table' AND rootpage = 0)",
      "SELECT 'generated column ' || c.name FROM sqlite_schema s, pragma_table_xinfo(s.name) c "
      "WHERE s.type = 'table' AND c.hidden > 0",
      "SELECT 'index of an expression ' || s.name FROM sqlite_schema s, "
      "pragma_index_xinfo(s.name) c WHERE s.type = 'index' AND c.cid = -2",
      "SELECT 'partial index ' || l.name FROM sqlite_schema s, pragma_index_list(s.name) l "
      "WHERE s.type = 'table' AND l.partial"};
  for (const char* query : kQueries) {
    if (auto found = find_text(base, query)) return found;
  }
  return std::nullopt;
}

/// A path in a URI of SQLite.
std::string uri_of(const fs::path& path) {
  std::string uri = "file://";
  for (const char c : fs::absolute(path).string()) {
    const bool is_special = c == '%' || c == '?' || c == '#';
    uri += is_special ? fmt::format("%{:02x}", static_cast<unsigned>(c)) : std::string(1, c);
  }
  return uri;
}

bool has_table(const SqliteDatabase& base, const std::string& table) {
  return base && prepare_sqlite(base.get(), fmt::format("SELECT 1 FROM {}", table).c_str());
}

}  // namespace

SqliteDatabase open_sqlite(const fs::path& path, const std::string& table, SqliteAccess access) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) return nullptr;
  if (names_other_file(path.string() + "-journal")) {
    throw InputError(path.string() + "-journal", "names another file, expected it to name none");
  }
  const std::int64_t size = num_bytes(path);
  SqliteDatabase base = open_uri(uri_of(path), access, size);
  // What still stands in the journal of a program that did not end is read along, unless the folder
  // cannot be written, where such a journal cannot be used.
  if (access == SqliteAccess::kRead && !has_table(base, table)) {
    base = open_uri(uri_of(path) + "?immutable=1", access, size);
  }
  if (!has_table(base, table)) return nullptr;
  if (const auto found = find_definition(base.get())) {
    throw InputError(path.string(),
                     fmt::format("defines what would be run, {}, expected an SQLite data base of "
                                 "plain tables",
                                 quote_for_message(*found)));
  }
  sqlite3_set_authorizer(base.get(), authorize, nullptr);
  // Whoever writes adds to what there is.
  *base.get_deleter().num_steps_left =
      access == SqliteAccess::kWrite ? INT64_MAX : kStepsOfAny + kStepsPerByte * size;
  return base;
}

SqliteStatement prepare_sqlite(sqlite3* base, const char* query) {
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(base, query, -1, &statement, nullptr);
  return SqliteStatement(statement);
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/atlas_database.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <map>
#include <utility>

#include "waymark/atlas/atlas_rows.h"
#include "waymark/base/check.h"
#include "waymark/mapfile/map_layout.h"
#include "waymark/place/place_segment.h"

namespace waymark {
namespace {

constexpr const char* kAtlasSchema = R"(
PRAGMA application_id = 1464680788;
CREATE TABLE state (generation INTEGER NOT NULL);
INSERT INTO state VALUES (0);
CREATE TABLE recording (checksum TEXT PRIMARY KEY NOT NULL, name TEXT NOT NULL,
  since INTEGER NOT NULL) WITHOUT ROWID;
CREATE TABLE tile (origin TEXT PRIMARY KEY NOT NULL, checksum TEXT NOT NULL, places TEXT NOT NULL,
  recording TEXT NOT NULL, submap INTEGER NOT NULL, keyframes INTEGER NOT NULL,
  landmarks INTEGER NOT NULL, is_metric INTEGER NOT NULL, pixel_angle_rad REAL NOT NULL,
  centre_x REAL NOT NULL, centre_y REAL NOT NULL, centre_z REAL NOT NULL, radius REAL NOT NULL,
  frame INTEGER NOT NULL, qx REAL NOT NULL, qy REAL NOT NULL, qz REAL NOT NULL, qw REAL NOT NULL,
  tx REAL NOT NULL, ty REAL NOT NULL, tz REAL NOT NULL, scale REAL NOT NULL) WITHOUT ROWID;
CREATE TABLE link (a TEXT NOT NULL, b TEXT NOT NULL, is_border INTEGER NOT NULL,
  shared INTEGER NOT NULL, qx REAL NOT NULL, qy REAL NOT NULL, qz REAL NOT NULL, qw REAL NOT NULL,
  tx REAL NOT NULL, ty REAL NOT NULL, tz REAL NOT NULL, scale REAL NOT NULL,
  PRIMARY KEY (a, b)) WITHOUT ROWID;
CREATE TABLE shared (a TEXT NOT NULL, b TEXT NOT NULL, landmarks BLOB NOT NULL,
  PRIMARY KEY (a, b));
PRAGMA user_version = 1;
)";

constexpr std::int64_t kApplicationId = 1464680788;  // "WMAT"; as in the schema.
constexpr std::int64_t kVersion = 1;
constexpr int kBusyTimeoutMs = 60'000;
constexpr std::int64_t kMaxTiles = std::int64_t{1} << 24;

void execute_atlas(sqlite3* base, const std::filesystem::path& path, const char* sql) {
  if (sqlite3_exec(base, sql, nullptr, nullptr, nullptr) == SQLITE_OK) return;
  throw OutputError(path.string(), std::string("cannot be written: ") + sqlite3_errmsg(base));
}

std::int64_t pragma_value(sqlite3* base, const std::filesystem::path& path, const char* sql) {
  AtlasRows rows(base, path, sql);
  return rows.next() ? rows.whole("value", INT64_MAX) : 0;
}

/// AtlasRows come strictly ascending by their keys; in a damaged file pages may lead in a circle,
/// which has no end.
void expect_ascending(const AtlasRows& rows, const std::string& before, const std::string& key) {
  if (key <= before) rows.fail("key", "expected rows in order, each once");
}

/// Makes one where there is none; what is there stays.
SqliteDatabase make_empty(const std::filesystem::path& path) {
  sqlite3* opened = nullptr;
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX;
  const int status = sqlite3_open_v2(path.c_str(), &opened, flags, nullptr);
  SqliteDatabase base(opened);
  if (status != SQLITE_OK) {
    throw OutputError(path.string(), std::string("cannot be written: ") + sqlite3_errstr(status));
  }
  sqlite3_busy_timeout(opened, kBusyTimeoutMs);
  execute_atlas(opened, path, "BEGIN IMMEDIATE");
  // Of several that find none, the first one that is here makes it.
  if (pragma_value(opened, path, "PRAGMA schema_version") == 0) {
    execute_atlas(opened, path, kAtlasSchema);
  }
  execute_atlas(opened, path, "COMMIT");
  return base;
}

/// Whether it defines what an atlas does, to the letter: constraints are run where rows are
/// written.
bool is_of_an_atlas(sqlite3* base, const std::filesystem::path& path) {
  const SqliteDatabase own = make_empty(":memory:");
  const char* query = "SELECT name, sql FROM sqlite_schema WHERE sql IS NOT NULL ORDER BY name";
  AtlasRows there(base, path, query), expected(own.get(), path, query);
  while (expected.next()) {
    if (!there.next() || there.text("name") != expected.text("name") ||
        there.text("sql") != expected.text("sql")) {
      return false;
    }
  }
  return !there.next();
}

/// Whether somebody writes it, or was killed while he did.
bool has_journal(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::exists(path.string() + "-journal", ignored);
}

template <class Item>
std::map<std::string, std::uint32_t> number_by(const std::vector<Item>& items,
                                               std::string Item::*key) {
  std::map<std::string, std::uint32_t> numbers;
  for (std::uint32_t i = 0; i < items.size(); ++i) numbers.emplace(items[i].*key, i);
  return numbers;
}

}  // namespace

AtlasDatabase::~AtlasDatabase() = default;

void AtlasDatabase::create(const std::filesystem::path& path) {
  // Takes back what a killed program had begun, which may be all of it.
  if (has_journal(path)) open_sqlite(path, "state", SqliteAccess::kWrite);
  std::error_code error;
  const bool has_pages = std::filesystem::file_size(path, error) > 0 && !error;
  if (!has_pages) make_empty(path);
}

// Who only reads may have to take back what a killed writer had begun.
AtlasDatabase::AtlasDatabase(const std::filesystem::path& path, bool is_writable)
    : path_(path),
      base_(open_sqlite(
          path,
          "state",
          is_writable || has_journal(path) ? SqliteAccess::kWrite : SqliteAccess::kRead)) {
  if (!base_) throw InputError(path.string(), "cannot be read, expected the data base of an atlas");
  if (pragma_value(base_.get(), path_, "PRAGMA application_id") != kApplicationId) {
    throw InputError(path.string(), "is no data base of an atlas");
  }
  const std::int64_t version = pragma_value(base_.get(), path_, "PRAGMA user_version");
  if (version != kVersion) {
    throw InputError(
        path.string(),
        fmt::format(
            "has version {}, expected {}; a newer program may have written it", version, kVersion));
  }
  if (!is_of_an_atlas(base_.get(), path)) {
    throw InputError(path.string(), "has other tables than the data base of an atlas");
  }
  sqlite3_busy_timeout(base_.get(), kBusyTimeoutMs);
  execute_atlas(base_.get(), path_, is_writable ? "BEGIN IMMEDIATE" : "BEGIN");
}

std::int64_t AtlasDatabase::generation() const {
  AtlasRows rows(base_.get(), path_, "SELECT generation FROM state");
  if (!rows.next()) throw InputError(path_.string(), "has no state, expected one");
  return rows.whole("generation", INT64_MAX - 1);
}

AtlasContents AtlasDatabase::read() const {
  AtlasContents contents;
  AtlasRows rows(
      base_.get(), path_, "SELECT checksum, name, since FROM recording ORDER BY checksum");
  std::string before;
  while (rows.next()) {
    AtlasRecording recording;
    recording.checksum = rows.checksum("checksum");
    recording.name = rows.text("name");
    recording.since = static_cast<std::uint32_t>(rows.whole("since", UINT32_MAX - 1));
    expect_ascending(rows, std::exchange(before, recording.checksum), recording.checksum);
    contents.recordings.push_back(std::move(recording));
  }
  read_tiles(contents);
  read_links(contents);
  return contents;
}

void AtlasDatabase::read_tiles(AtlasContents& contents) const {
  const auto recordings = number_by(contents.recordings, &AtlasRecording::checksum);
  AtlasRows rows(
      base_.get(),
      path_,
      "SELECT origin, checksum, places, recording, submap, keyframes, landmarks, is_metric, "
      "pixel_angle_rad, centre_x, centre_y, centre_z, radius, frame, qx, qy, qz, qw, tx, ty, "
      "tz, scale FROM tile ORDER BY origin");
  std::string before;
  while (rows.next()) {
    AtlasTile tile;
    tile.origin = rows.checksum("origin");
    tile.checksum = rows.checksum("checksum");
    tile.places = rows.checksum("places");
    const auto recording = recordings.find(rows.checksum("recording"));
    if (recording == recordings.end()) rows.fail("recording", "expected one that is there");
    tile.recording = recording->second;
    tile.submap = static_cast<std::uint32_t>(rows.whole("submap", kMaxSubmaps));
    tile.num_keyframes =
        static_cast<std::uint32_t>(rows.whole("keyframes", PlaceSegment::kMaxRows));
    if (tile.num_keyframes == 0) rows.fail("keyframes", "expected at least one");
    tile.num_landmarks = static_cast<std::uint32_t>(rows.whole("landmarks", kMaxIds));
    tile.is_metric = rows.whole("is_metric", 1) != 0;
    tile.pixel_angle_rad = rows.number("pixel_angle_rad", kFeatureSizeRange);
    for (double& value : tile.centre) value = rows.number("centre", kLengthRange);
    tile.radius = rows.number("radius", {0.0, kLengthRange.high});
    tile.frame = static_cast<std::uint32_t>(rows.whole("frame", kMaxTiles));
    tile.atlas_from_tile = rows.transform();
    expect_ascending(rows, std::exchange(before, tile.origin), tile.origin);
    if (contents.tiles.size() == kMaxTiles) rows.fail("tile", "expected fewer");
    contents.tiles.push_back(std::move(tile));
  }
  const auto num_tiles = contents.tiles.size();
  if (std::ranges::any_of(contents.tiles,
                          [&](const auto& one) { return one.frame >= num_tiles; })) {
    rows.fail("frame", fmt::format("expected one of at most {} parts", num_tiles));
  }
}

void AtlasDatabase::read_links(AtlasContents& contents) const {
  const auto tiles = number_by(contents.tiles, &AtlasTile::origin);
  AtlasRows rows(base_.get(),
                 path_,
                 "SELECT a, b, is_border, shared, qx, qy, qz, qw, tx, ty, tz, scale FROM link "
                 "ORDER BY a, b");
  std::string before;
  while (rows.next()) {
    AtlasLink link;
    const std::string a = rows.checksum("a"), b = rows.checksum("b");
    const auto at_a = tiles.find(a), at_b = tiles.find(b);
    if (at_a == tiles.end() || at_b == tiles.end() || a >= b) {
      rows.fail("a, b", "expected two tiles that are there, in order");
    }
    link.a = at_a->second;
    link.b = at_b->second;
    if (contents.tiles[link.a].frame != contents.tiles[link.b].frame) {
      rows.fail("a, b", "expected two tiles of the same frame");
    }
    link.is_border = rows.whole("is_border", 1) != 0;
    link.num_shared = static_cast<std::uint32_t>(rows.whole("shared", kMaxIds));
    link.b_from_a = rows.transform();
    expect_ascending(rows, std::exchange(before, a + b), a + b);
    contents.links.push_back(link);
  }
}

SharedLandmarks AtlasDatabase::read_shared(const std::string& origin_a,
                                           const std::string& origin_b) const {
  AtlasRows rows(base_.get(), path_, "SELECT landmarks FROM shared WHERE a = ? AND b = ?");
  rows.add(origin_a).add(origin_b);
  if (!rows.next()) {
    throw InputError(path_.string(), "lacks the shared landmarks of a link, expected a row");
  }
  return rows.landmarks();
}

void AtlasDatabase::write(const AtlasContents& contents, const std::vector<NewShared>& shared) {
  sqlite3* const base = base_.get();
  execute_atlas(base, path_, "DELETE FROM recording; DELETE FROM tile; DELETE FROM link;");
  AtlasRows recordings(base, path_, "INSERT INTO recording VALUES (?, ?, ?)");
  for (const AtlasRecording& recording : contents.recordings) {
    recordings.add(recording.checksum).add(recording.name).add(std::int64_t{recording.since}).run();
  }
  AtlasRows tiles(
      base,
      path_,
      "INSERT INTO tile VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, "
      "?, ?)");
  for (const AtlasTile& tile : contents.tiles) {
    tiles.add(tile.origin).add(tile.checksum).add(tile.places);
    tiles.add(contents.recordings[tile.recording].checksum).add(std::int64_t{tile.submap});
    tiles.add(std::int64_t{tile.num_keyframes}).add(std::int64_t{tile.num_landmarks});
    tiles.add(std::int64_t{tile.is_metric}).add(tile.pixel_angle_rad);
    for (const double value : tile.centre) tiles.add(value);
    tiles.add(tile.radius).add(std::int64_t{tile.frame}).add(tile.atlas_from_tile).run();
  }
  AtlasRows links(base, path_, "INSERT INTO link VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  for (const AtlasLink& link : contents.links) {
    links.add(contents.tiles[link.a].origin).add(contents.tiles[link.b].origin);
    links.add(std::int64_t{link.is_border}).add(std::int64_t{link.num_shared});
    links.add(link.b_from_a).run();
  }
  AtlasRows landmarks(base, path_, "INSERT OR REPLACE INTO shared VALUES (?, ?, ?)");
  for (const NewShared& pairs : shared) {
    landmarks.add(pairs.origin_a).add(pairs.origin_b).add(pairs.landmarks).run();
  }
  AtlasRows(base, path_, "UPDATE state SET generation = generation + 1").run();
}

void AtlasDatabase::finish() { execute_atlas(base_.get(), path_, "COMMIT"); }

}  // namespace waymark

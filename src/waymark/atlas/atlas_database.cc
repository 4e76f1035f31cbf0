// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/atlas_database.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <optional>

#include "waymark/base/check.h"
#include "waymark/base/sha256.h"
#include "waymark/base/text.h"
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
constexpr std::int64_t kMaxTiles = std::int64_t{1} << 24;

struct FinalizeStatement {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};

/// A statement with its parameters and the values of its current row, each asked for with what it
/// may be.
class AtlasRows {
 public:
  AtlasRows(sqlite3* base, const std::filesystem::path& path, const char* sql)
      : base_(base), path_(path), what_(sql) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(base, sql, -1, &statement, nullptr) != SQLITE_OK) {
      throw InputError(path.string(), "cannot be read, expected the data base of an atlas");
    }
    statement_.reset(statement);
  }

  AtlasRows& add(const std::string& value) {
    sqlite3_bind_text(statement_.get(),
                      ++parameter_,
                      value.data(),
                      static_cast<int>(value.size()),
                      SQLITE_TRANSIENT);
    return *this;
  }
  AtlasRows& add(std::int64_t value) {
    sqlite3_bind_int64(statement_.get(), ++parameter_, value);
    return *this;
  }
  AtlasRows& add(double value) {
    if (!std::isfinite(value)) throw OutputError(path_.string(), "would hold what is not finite");
    sqlite3_bind_double(statement_.get(), ++parameter_, value);
    return *this;
  }
  AtlasRows& add(const SharedLandmarks& landmarks) {
    std::vector<std::uint32_t> ids;
    for (const auto& [a, b] : landmarks) ids.insert(ids.end(), {a.value, b.value});
    sqlite3_bind_blob64(
        statement_.get(), ++parameter_, ids.data(), ids.size() * sizeof(ids[0]), SQLITE_TRANSIENT);
    return *this;
  }
  AtlasRows& add(const Sim3& transform) {
    for (const double value : transform.rotation.coeffs()) add(value);
    for (const double value : transform.translation) add(value);
    return add(transform.scale);
  }
  void run() {
    if (sqlite3_step(statement_.get()) != SQLITE_DONE) {
      throw OutputError(path_.string(), std::string("cannot be written: ") + sqlite3_errmsg(base_));
    }
    sqlite3_reset(statement_.get());
    parameter_ = 0;
  }

  /// Steps to the next row.
  bool next() {
    column_ = -1;
    const int status = sqlite3_step(statement_.get());
    if (status != SQLITE_ROW && status != SQLITE_DONE) {
      throw InputError(path_.string(),
                       std::string("is damaged: ") + sqlite3_errmsg(base_) +
                           ", expected the data base of an atlas");
    }
    return status == SQLITE_ROW;
  }
  std::int64_t whole(const char* name, std::int64_t max) {
    const std::int64_t value = sqlite3_column_int64(statement_.get(), ++column_);
    if (sqlite3_column_type(statement_.get(), column_) != SQLITE_INTEGER || value < 0 ||
        value > max) {
      fail(name, fmt::format("expected a whole number of at most {}", max));
    }
    return value;
  }
  double number(const char* name, const NumberRange& range) {
    const double value = sqlite3_column_double(statement_.get(), ++column_);
    if (sqlite3_column_type(statement_.get(), column_) != SQLITE_FLOAT || !range.contains(value)) {
      fail(name, "expected a number that is possible");
    }
    return value;
  }
  std::string text(const char* name) {
    const auto* value =
        reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), ++column_));
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column_));
    if (sqlite3_column_type(statement_.get(), column_) != SQLITE_TEXT || !value ||
        size > kMaxTextBytes) {
      fail(name, "expected a text");
    }
    return {value, size};
  }
  std::string checksum(const char* name) {
    std::string value = text(name);
    if (!is_sha256(value)) fail(name, "expected a SHA-256 checksum");
    return value;
  }
  Sim3 transform() {
    Sim3 transform;
    for (double& value : transform.rotation.coeffs()) value = number("rotation", {-2.0, 2.0});
    if (std::abs(transform.rotation.norm() - 1.0) > kMaxNormError) {
      fail("rotation", "expected a unit quaternion");
    }
    for (double& value : transform.translation) value = number("translation", kLengthRange);
    transform.scale = number("scale", kScaleRange);
    return transform;
  }
  SharedLandmarks landmarks() {
    const void* bytes = sqlite3_column_blob(statement_.get(), ++column_);
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column_));
    constexpr std::size_t kPairBytes = 2 * sizeof(std::uint32_t);
    if (sqlite3_column_type(statement_.get(), column_) != SQLITE_BLOB || size % kPairBytes != 0) {
      fail("landmarks", "expected pairs of numbers");
    }
    std::vector<std::uint32_t> ids(size / sizeof(std::uint32_t));
    if (size > 0) std::memcpy(ids.data(), bytes, size);
    SharedLandmarks landmarks;
    for (std::size_t i = 0; i < ids.size(); i += 2) {
      if (ids[i] >= kMaxIds || ids[i + 1] >= kMaxIds) fail("landmarks", "expected ids");
      landmarks.push_back({LandmarkId{ids[i]}, LandmarkId{ids[i + 1]}});
    }
    return landmarks;
  }
  /// The message names the statement, which says table and column.
  [[noreturn]] void fail(const char* name, const std::string& expected) const {
    throw InputError(path_.string(), fmt::format("{} of a row of '{}': {}", name, what_, expected));
  }

 private:
  sqlite3* base_;
  const std::filesystem::path& path_;
  const char* what_;
  std::unique_ptr<sqlite3_stmt, FinalizeStatement> statement_;
  int parameter_ = 0;
  int column_ = -1;
};

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

template <class Item>
std::map<std::string, std::uint32_t> number_by(const std::vector<Item>& items,
                                               std::string Item::*key) {
  std::map<std::string, std::uint32_t> numbers;
  for (std::uint32_t i = 0; i < items.size(); ++i) numbers.emplace(items[i].*key, i);
  return numbers;
}

}  // namespace

void AtlasDatabase::Close::operator()(sqlite3* base) const { sqlite3_close_v2(base); }

AtlasDatabase::~AtlasDatabase() = default;

void AtlasDatabase::create(const std::filesystem::path& path) {
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  sqlite3* opened = nullptr;
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX;
  const int status = sqlite3_open_v2(path.c_str(), &opened, flags, nullptr);
  const std::unique_ptr<sqlite3, Close> base(opened);
  if (status != SQLITE_OK) {
    throw OutputError(path.string(), std::string("cannot be written: ") + sqlite3_errstr(status));
  }
  execute_atlas(base.get(), path, "BEGIN");
  execute_atlas(base.get(), path, kAtlasSchema);
  execute_atlas(base.get(), path, "COMMIT");
}

AtlasDatabase::AtlasDatabase(const std::filesystem::path& path, bool is_writable) : path_(path) {
  sqlite3* opened = nullptr;
  const int flags =
      (is_writable ? SQLITE_OPEN_READWRITE : SQLITE_OPEN_READONLY) | SQLITE_OPEN_NOMUTEX;
  const int status = sqlite3_open_v2(path.c_str(), &opened, flags, nullptr);
  base_.reset(opened);
  if (status != SQLITE_OK) {
    throw InputError(path.string(), "cannot be read, expected the data base of an atlas");
  }
  for (const int option : {SQLITE_DBCONFIG_ENABLE_TRIGGER,
                           SQLITE_DBCONFIG_ENABLE_VIEW,
                           SQLITE_DBCONFIG_TRUSTED_SCHEMA}) {
    sqlite3_db_config(base_.get(), option, 0, nullptr);
  }
  sqlite3_busy_timeout(base_.get(), 10'000);
  sqlite3_exec(base_.get(), "PRAGMA cell_size_check=ON", nullptr, nullptr, nullptr);
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

std::int64_t AtlasDatabase::write(const AtlasContents& contents,
                                  const std::vector<NewShared>& shared,
                                  std::int64_t generation) {
  sqlite3* const base = base_.get();
  execute_atlas(base, path_, "BEGIN IMMEDIATE");  // Rolled back when it is closed before its end.
  if (this->generation() != generation) {
    throw OutputError(path_.string(), "was changed meanwhile by another program; run it again");
  }
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
  AtlasRows state(base, path_, "UPDATE state SET generation = ?");
  state.add(generation + 1).run();
  execute_atlas(base, path_, "COMMIT");
  return generation + 1;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/colmap_database.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "waymark/base/check.h"

namespace waymark {
namespace {

/// As version 3.8 makes it; later versions add what they miss.
constexpr const char* kSchema = R"(
PRAGMA user_version = 3800;
CREATE TABLE cameras (camera_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, model INTEGER NOT NULL,
  width INTEGER NOT NULL, height INTEGER NOT NULL, params BLOB, prior_focal_length INTEGER NOT NULL);
CREATE TABLE images (image_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, name TEXT NOT NULL UNIQUE,
  camera_id INTEGER NOT NULL, prior_qw REAL, prior_qx REAL, prior_qy REAL, prior_qz REAL,
  prior_tx REAL, prior_ty REAL, prior_tz REAL,
  CONSTRAINT image_id_check CHECK(image_id >= 0 and image_id < 2147483647),
  FOREIGN KEY(camera_id) REFERENCES cameras(camera_id));
CREATE UNIQUE INDEX index_name ON images(name);
CREATE TABLE keypoints (image_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER NOT NULL,
  cols INTEGER NOT NULL, data BLOB,
  FOREIGN KEY(image_id) REFERENCES images(image_id) ON DELETE CASCADE);
CREATE TABLE descriptors (image_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER NOT NULL,
  cols INTEGER NOT NULL, data BLOB,
  FOREIGN KEY(image_id) REFERENCES images(image_id) ON DELETE CASCADE);
CREATE TABLE matches (pair_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER NOT NULL,
  cols INTEGER NOT NULL, data BLOB);
CREATE TABLE two_view_geometries (pair_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER NOT NULL,
  cols INTEGER NOT NULL, data BLOB, config INTEGER NOT NULL, F BLOB, E BLOB, H BLOB, qvec BLOB,
  tvec BLOB);
)";

/// Of a track each observation is matched to so many that follow: those of points that hundreds of
/// views see would be tens of thousands otherwise. COLMAP follows matches from view to view.
constexpr std::size_t kMaxPartners = 10;
constexpr std::int64_t kPairFactor = 2147483647;  // Of the documentation.
constexpr std::int64_t kCalibrated = 2;           // Its name for pairs whose cameras are known.

/// One kind of row, inserted again and again. Numbers are stored as this machine has them, which
/// COLMAP takes to be little-endian.
class Insertion {
 public:
  Insertion(sqlite3* base, const char* sql, const std::filesystem::path& path)
      : base_(base), path_(path) {
    if (sqlite3_prepare_v2(base, sql, -1, &statement_, nullptr) != SQLITE_OK) fail();
  }
  ~Insertion() { sqlite3_finalize(statement_); }
  Insertion(const Insertion&) = delete;
  Insertion& operator=(const Insertion&) = delete;

  Insertion& number(std::int64_t value) {
    sqlite3_bind_int64(statement_, ++column_, value);
    return *this;
  }
  Insertion& text(const std::string& value) {
    sqlite3_bind_text(
        statement_, ++column_, value.data(), static_cast<int>(value.size()), SQLITE_TRANSIENT);
    return *this;
  }
  template <class T>
  Insertion& blob(std::span<const T> values) {
    sqlite3_bind_blob64(
        statement_, ++column_, values.data(), values.size_bytes(), SQLITE_TRANSIENT);
    return *this;
  }
  void insert() {
    if (sqlite3_step(statement_) != SQLITE_DONE) fail();
    sqlite3_reset(statement_);
    column_ = 0;
  }

 private:
  [[noreturn]] void fail() const {
    throw OutputError(path_.string(), std::string("cannot be written: ") + sqlite3_errmsg(base_));
  }

  sqlite3* base_;
  const std::filesystem::path& path_;
  sqlite3_stmt* statement_ = nullptr;
  int column_ = 0;
};

/// Pairs of features of two views, the first view having the smaller index.
using ViewPair = std::pair<std::uint32_t, std::uint32_t>;
using ViewMatches = std::map<ViewPair, std::vector<std::uint32_t>>;

ViewMatches match_views(const ExportScene& scene) {
  ViewMatches matches;
  for (const ExportPoint& point : scene.points) {
    std::vector<ExportObservation> track = point.observations;
    std::ranges::sort(track, {}, &ExportObservation::view);
    for (std::size_t a = 0; a < track.size(); ++a) {
      const std::size_t end = std::min(track.size(), a + 1 + kMaxPartners);
      for (std::size_t b = a + 1; b < end; ++b) {
        std::vector<std::uint32_t>& pairs = matches[{track[a].view, track[b].view}];
        pairs.push_back(track[a].feature);
        pairs.push_back(track[b].feature);
      }
    }
  }
  return matches;
}

/// The essential matrix of two views, row by row (Hartley and Zisserman 2003, eq. 9.12).
std::array<double, 9> essential_matrix(const Rigid3& b_from_a) {
  const Eigen::Vector3d& t = b_from_a.translation;
  Eigen::Matrix3d cross;
  cross << 0.0, -t.z(), t.y(), t.z(), 0.0, -t.x(), -t.y(), t.x(), 0.0;
  const Eigen::Matrix3d essential = cross * b_from_a.rotation_matrix();
  std::array<double, 9> rows;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows.data()) = essential;
  return rows;
}

void add_cameras(sqlite3* base,
                 const std::filesystem::path& path,
                 const ExportScene& scene,
                 ColmapIds numbers) {
  Insertion cameras(base, "INSERT INTO cameras VALUES (?, ?, ?, ?, ?, 1)", path);
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    const ColmapCamera camera = colmap_camera(scene.cameras[i]);
    cameras.number(numbers.first_camera + static_cast<std::int64_t>(i))
        .number(camera.model_id)
        .number(scene.cameras[i].width_px)
        .number(scene.cameras[i].height_px)
        .blob(std::span<const double>(camera.params))
        .insert();
  }
}

void add_images(sqlite3* base,
                const std::filesystem::path& path,
                const ExportScene& scene,
                ColmapIds numbers) {
  Insertion images(base, "INSERT INTO images (image_id, name, camera_id) VALUES (?, ?, ?)", path);
  Insertion keypoints(base, "INSERT INTO keypoints VALUES (?, ?, 2, ?)", path);
  std::vector<float> pixels;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const ExportView& view = scene.views[i];
    const std::int64_t number = numbers.first_image + static_cast<std::int64_t>(i);
    images.number(number)
        .text(view.name)
        .number(numbers.first_camera + static_cast<std::int64_t>(view.camera))
        .insert();
    pixels.clear();
    for (const Eigen::Vector2d& pixel : view.pixels) {
      pixels.push_back(static_cast<float>(pixel.x() + 0.5));
      pixels.push_back(static_cast<float>(pixel.y() + 0.5));
    }
    keypoints.number(number)
        .number(static_cast<std::int64_t>(view.pixels.size()))
        .blob(std::span<const float>(pixels))
        .insert();
  }
}

void add_pairs(sqlite3* base,
               const std::filesystem::path& path,
               const ExportScene& scene,
               ColmapIds numbers) {
  Insertion matches(base, "INSERT INTO matches VALUES (?, ?, 2, ?)", path);
  Insertion pairs(
      base, "INSERT INTO two_view_geometries VALUES (?, ?, 2, ?, ?, ?, ?, ?, ?, ?)", path);
  constexpr std::array<double, 9> kUnknown{};
  for (const auto& [pair, features] : match_views(scene)) {
    const auto [a, b] = pair;
    const std::int64_t pair_id = (numbers.first_image + std::int64_t{a}) * kPairFactor +
                                 numbers.first_image + std::int64_t{b};
    const auto num_matches = static_cast<std::int64_t>(features.size() / 2);
    const Rigid3 b_from_a = scene.views[b].cam_from_world * scene.views[a].cam_from_world.inverse();
    const Eigen::Quaterniond& q = b_from_a.rotation;
    const std::array<double, 4> rotation = {q.w(), q.x(), q.y(), q.z()};
    matches.number(pair_id)
        .number(num_matches)
        .blob(std::span<const std::uint32_t>(features))
        .insert();
    pairs.number(pair_id)
        .number(num_matches)
        .blob(std::span<const std::uint32_t>(features))
        .number(kCalibrated)
        .blob(std::span<const double>(kUnknown))
        .blob(std::span<const double>(essential_matrix(b_from_a)))
        .blob(std::span<const double>(kUnknown))
        .blob(std::span<const double>(rotation))
        .blob(std::span<const double>(b_from_a.translation.data(), 3))
        .insert();
  }
}

void execute(sqlite3* base, const char* sql, const std::filesystem::path& path) {
  if (sqlite3_exec(base, sql, nullptr, nullptr, nullptr) == SQLITE_OK) return;
  throw OutputError(path.string(), std::string("cannot be written: ") + sqlite3_errmsg(base));
}

/// Whether each view is connected to another, as COLMAP has it, or has no features.
std::vector<bool> find_connected(const ExportScene& scene) {
  std::vector<bool> is_connected;
  for (const ExportView& view : scene.views) is_connected.push_back(view.pixels.empty());
  for (const auto& [pair, features] : match_views(scene)) {
    if (features.size() / 2 < kMinColmapMatches) continue;
    is_connected[pair.first] = is_connected[pair.second] = true;
  }
  return is_connected;
}

/// Takes away the observations of some views, and the last one of a point.
void take_observations(ExportScene& scene, const std::vector<bool>& is_kept) {
  for (ExportPoint& point : scene.points) {
    const auto num_kept = std::ranges::count_if(
        point.observations, [&](const ExportObservation& seen) { return is_kept[seen.view]; });
    std::erase_if(point.observations, [&](const ExportObservation& seen) {
      if (is_kept[seen.view] && num_kept >= 2) return false;
      scene.views[seen.view].points[seen.feature] = kNoPoint;
      return true;
    });
  }
}

}  // namespace

void unlink_loose_views(ExportScene& scene) {
  // What one view loses may disconnect the next.
  for (auto is_connected = find_connected(scene); std::ranges::count(is_connected, false) > 0;
       is_connected = find_connected(scene)) {
    take_observations(scene, is_connected);
    for (std::size_t v = 0; v < scene.views.size(); ++v) {
      if (is_connected[v]) continue;
      scene.views[v].pixels.clear();
      scene.views[v].points.clear();
    }
  }
}

void ColmapDatabase::Close::operator()(sqlite3* base) const { sqlite3_close_v2(base); }

ColmapDatabase::ColmapDatabase(const std::filesystem::path& path) : path_(path) {
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  sqlite3* opened = nullptr;
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX;
  const int status = sqlite3_open_v2(path.c_str(), &opened, flags, nullptr);
  base_.reset(opened);
  if (status != SQLITE_OK) {
    throw OutputError(path.string(), std::string("cannot be written: ") + sqlite3_errstr(status));
  }
  // Whoever makes the file sees to it that it is there as a whole or not at all.
  execute(base_.get(), "PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; BEGIN;", path_);
  execute(base_.get(), kSchema, path_);
}

ColmapDatabase::~ColmapDatabase() = default;

void ColmapDatabase::add(const ExportScene& scene, ColmapIds numbers) {
  add_cameras(base_.get(), path_, scene, numbers);
  add_images(base_.get(), path_, scene, numbers);
  add_pairs(base_.get(), path_, scene, numbers);
}

void ColmapDatabase::finish() { execute(base_.get(), "COMMIT;", path_); }

}  // namespace waymark

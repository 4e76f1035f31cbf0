// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <numbers>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "waymark/bag/sqlite_file.h"
#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/exchange/openvslam_records.h"

namespace waymark {
namespace {

constexpr int kMaxValueBytes = 1 << 26;
constexpr std::int64_t kMaxDatabaseId = 4'000'000'000;
constexpr std::size_t kMaxDatabaseFeatures = 100'000;  // Of a keyframe.
constexpr double kMaxDatabaseLength = 1e9;             // Metres, and pixels.

/// A point of OpenCV's: x, y, size, angle in degrees, response as floats, octave, class as
/// integers.
constexpr std::size_t kKeypointBytes = 28;
constexpr std::size_t kDescriptorBytes = 32;

/// A row of a table, each value checked on its own. Blobs are memory of the machine that wrote
/// them: little-endian, as good as always.
class DatabaseRow {
 public:
  DatabaseRow(sqlite3_stmt* row, std::string where) : row_(row), where_(std::move(where)) {}

  [[noreturn]] void fail(int column, const std::string& what) const {
    throw InputError(where_, fmt::format("{} {}", sqlite3_column_name(row_, column), what));
  }
  std::string_view bytes(int column) const {
    const void* data = sqlite3_column_blob(row_, column);
    if (data == nullptr) return {};
    return {static_cast<const char*>(data),
            static_cast<std::size_t>(sqlite3_column_bytes(row_, column))};
  }
  std::string text(int column) const {
    std::string text(bytes(column));
    while (text.ends_with('\0')) text.pop_back();
    return text;
  }
  std::int64_t id(int column) const {
    const std::int64_t id = sqlite3_column_int64(row_, column);
    if (id > kMaxDatabaseId && id != UINT32_MAX) fail(column, "is beyond all ids");
    return id == UINT32_MAX ? -1 : std::max<std::int64_t>(id, -1);
  }
  std::int64_t count(int column) const {
    const std::int64_t count = sqlite3_column_int64(row_, column);
    if (count >= 0 && count <= UINT32_MAX) return count;
    fail(column, fmt::format("is {}, expected a count", count));
  }
  double number(int column, double limit = kMaxDatabaseLength) const {
    const double value = sqlite3_column_double(row_, column);
    if (std::abs(value) <= limit) return value;
    fail(column, fmt::format("is {}, expected at most {}", value, limit));
  }
  bool has(int column) const { return sqlite3_column_type(row_, column) != SQLITE_NULL; }

  /// The values of a blob. size: how many there have to be; nothing: any number.
  template <class T>
  std::vector<T> values(int column, std::optional<std::size_t> size) const {
    const std::string_view data = bytes(column);
    if (data.size() % sizeof(T) != 0 || (size && data.size() != *size * sizeof(T))) {
      fail(column,
           size ? fmt::format("has {} bytes, expected {}", data.size(), *size * sizeof(T))
                : fmt::format("has {} bytes, expected {} each", data.size(), sizeof(T)));
    }
    std::vector<T> values(data.size() / sizeof(T));
    if (!values.empty()) std::memcpy(values.data(), data.data(), data.size());
    if constexpr (std::is_floating_point_v<T>) {
      for (const T value : values) {
        if (!(std::abs(value) <= kMaxDatabaseLength)) fail(column, "holds a number beyond bounds");
      }
    }
    return values;
  }

 private:
  sqlite3_stmt* row_;
  std::string where_;
};

class DatabaseReader {
 public:
  explicit DatabaseReader(const std::filesystem::path& path)
      : name_(path.string()),
        bytes_left_(std::filesystem::file_size(path)),
        base_(open_sqlite(path, "keyframes")) {
    if (!base_) {
      throw InputError(name_,
                       "cannot be read as a map, expected an SQLite data base of stella_vslam with "
                       "the tables cameras, keyframes, landmarks, associations");
    }
    sqlite3_limit(base_.get(), SQLITE_LIMIT_LENGTH, kMaxValueBytes);
  }

  const std::string& name() const { return name_; }

  /// Reads the columns of a table row by row, the id first.
  void read(const std::string& table,
            const std::string& columns,
            const std::function<void(const DatabaseRow&)>& take) {
    const std::string query = fmt::format("SELECT id, {} FROM {} NOT INDEXED", columns, table);
    const SqliteStatement rows = prepare_sqlite(base_.get(), query.c_str());
    if (!rows) {
      throw InputError(name_,
                       fmt::format("{}: {}, expected a map of stella_vslam",
                                   table,
                                   printable(sqlite3_errmsg(base_.get()))));
    }
    SqliteRowOrder order;
    int status = SQLITE_ERROR;
    while ((status = sqlite3_step(rows.get())) == SQLITE_ROW && order.take(rows.get())) {
      count_bytes(rows.get());
      const std::int64_t id = sqlite3_column_int64(rows.get(), 0);
      take({rows.get(), fmt::format("{}: {}.{}", name_, table, id)});
    }
    if (status != SQLITE_DONE) throw InputError(name_, fmt::format("{}: is damaged", table));
  }

 private:
  /// Together values have no more bytes than the file, unless rows share pages.
  void count_bytes(sqlite3_stmt* row) {
    for (int i = 0; i < sqlite3_column_count(row); ++i) {
      const int type = sqlite3_column_type(row, i);
      if (type != SQLITE_BLOB && type != SQLITE_TEXT) continue;
      const auto size = static_cast<std::uintmax_t>(sqlite3_column_bytes(row, i));
      if (size > bytes_left_) throw InputError(name_, "holds more than its size, expected a map");
      bytes_left_ -= size;
    }
  }

  std::string name_;
  std::uintmax_t bytes_left_;
  SqliteDatabase base_;
};

void read_cameras(DatabaseReader& reader, OpenvslamRecords& records) {
  constexpr std::array kNumbers = {"cols",
                                   "rows",
                                   "fx",
                                   "fy",
                                   "cx",
                                   "cy",
                                   "k1",
                                   "k2",
                                   "p1",
                                   "p2",
                                   "k3",
                                   "k4",
                                   "focal_x_baseline",
                                   "distortion"};
  reader.read("cameras",
              fmt::format("name, setup_type, model_type, {}", fmt::join(kNumbers, ", ")),
              [&](const DatabaseRow& row) {
                OpenvslamCamera camera;
                camera.name = row.text(1);
                camera.where =
                    fmt::format("{}: camera {}", reader.name(), quote_for_message(camera.name));
                camera.setup = row.text(2);
                camera.model = row.text(3);
                for (std::size_t i = 0; i < kNumbers.size(); ++i) {
                  const int column = 4 + static_cast<int>(i);
                  if (row.has(column)) camera.numbers[kNumbers[i]] = row.number(column);
                }
                if (!records.cameras.try_emplace(camera.name, camera).second) {
                  row.fail(1, "is there twice, expected once");
                }
              });
}

void read_points(const DatabaseRow& row, int column, OpenvslamKeyframe& keyframe) {
  const std::string_view data = row.bytes(column);
  for (std::size_t i = 0; i < data.size() / kKeypointBytes; ++i) {
    std::array<float, 5> values;  // x, y, size, angle, response.
    std::int32_t level = 0;
    std::memcpy(values.data(), data.data() + i * kKeypointBytes, sizeof values);
    std::memcpy(&level, data.data() + i * kKeypointBytes + sizeof values, sizeof level);
    const bool is_sound = std::abs(values[0]) <= kMaxDatabaseLength &&
                          std::abs(values[1]) <= kMaxDatabaseLength && std::abs(values[3]) <= 1e6 &&
                          level >= 0 && level < 64;
    if (!is_sound) row.fail(column, fmt::format("[{}] is no key point", i));
    Keypoint keypoint;
    keypoint.x_px = values[0];
    keypoint.y_px = values[1];
    keypoint.angle_rad = static_cast<float>(
        std::remainder(values[3] * std::numbers::pi / 180.0, 2.0 * std::numbers::pi));
    keypoint.level = static_cast<std::uint8_t>(level);
    keyframe.keypoints.push_back(keypoint);
  }
}

OpenvslamKeyframe read_keyframe(const DatabaseRow& row, const std::string& where) {
  OpenvslamKeyframe keyframe;
  constexpr double kMaxTime = 9.2e9;  // Nanoseconds of it fit 64 bits.
  keyframe.timestamp_s = row.number(1, kMaxTime);
  if (keyframe.timestamp_s < 0.0) row.fail(1, "is negative, expected a time in seconds");
  keyframe.camera = row.text(2);
  const std::vector<double> pose = row.values<double>(3, 16);
  const Eigen::Matrix4d matrix = Eigen::Map<const Eigen::Matrix4d>(pose.data());
  const Rigid3 cam_from_world = rigid_from_matrix(matrix, where, "pose_cw");
  keyframe.rotation_cw = cam_from_world.rotation;
  keyframe.translation_cw = cam_from_world.translation;
  const auto count = static_cast<std::size_t>(row.count(4));
  if (count > kMaxDatabaseFeatures) row.fail(4, "is beyond all bounds");
  if (row.bytes(5).size() != count * kKeypointBytes) {
    row.fail(5, fmt::format("has {} bytes, expected {}", row.bytes(5).size(), count * 28));
  }
  read_points(row, 5, keyframe);
  // Empty in mono.
  if (!row.bytes(6).empty()) keyframe.right_columns_px = row.values<float>(6, count);
  if (!row.bytes(7).empty()) keyframe.depths_m = row.values<float>(7, count);
  const std::vector<std::uint64_t> words =
      row.values<std::uint64_t>(8, count * kDescriptorBytes / sizeof(std::uint64_t));
  keyframe.descriptors.resize(count);
  for (std::size_t i = 0; i < words.size(); ++i) keyframe.descriptors[i / 4][i % 4] = words[i];
  return keyframe;
}

void read_keyframes(DatabaseReader& reader,
                    const OpenvslamPyramid& pyramid,
                    OpenvslamRecords& records) {
  reader.read("keyframes",
              "ts, cam, pose_cw, n_keypts, undist_keypts, x_rights, depths, descs",
              [&](const DatabaseRow& row) {
                const std::int64_t id = row.id(0);
                if (id < 0) row.fail(0, "is negative, expected the id of a keyframe");
                const std::string where = fmt::format("{}: keyframes.{}", reader.name(), id);
                OpenvslamKeyframe& keyframe = records.keyframes[id] = read_keyframe(row, where);
                keyframe.pyramid = pyramid;
              });
}

/// What each keyframe sees, and how keyframes hang together.
void read_associations(DatabaseReader& reader, OpenvslamRecords& records) {
  reader.read("associations", "lm_ids, span_parent, loop_edges", [&](const DatabaseRow& row) {
    const auto found = records.keyframes.find(row.id(0));
    if (found == records.keyframes.end()) return;
    OpenvslamKeyframe& keyframe = found->second;
    for (const std::int32_t id : row.values<std::int32_t>(1, keyframe.keypoints.size())) {
      keyframe.landmarks.push_back(id);
    }
    keyframe.parent = row.id(2);
    for (const std::int32_t id : row.values<std::int32_t>(3, std::nullopt)) {
      keyframe.loop_edges.push_back(id);
    }
  });
  for (auto& [id, keyframe] : records.keyframes) {
    if (keyframe.landmarks.size() == keyframe.keypoints.size()) continue;
    throw InputError(fmt::format("{}: associations.{}", reader.name(), id),
                     "is missing, expected what the keyframe sees");
  }
}

void read_landmarks(DatabaseReader& reader, OpenvslamRecords& records) {
  reader.read("landmarks", "pos_w, ref_keyfrm, n_vis, n_fnd", [&](const DatabaseRow& row) {
    const std::int64_t id = row.id(0);
    if (id < 0) row.fail(0, "is negative, expected the id of a landmark");
    OpenvslamLandmark& landmark = records.landmarks[id];
    const std::vector<double> position = row.values<double>(1, 3);
    landmark.position_in_world = {position[0], position[1], position[2]};
    landmark.reference = row.id(2);
    landmark.num_visible = row.count(3);
    landmark.num_found = row.count(4);
  });
}

}  // namespace

OpenvslamRecords read_openvslam_database(const std::filesystem::path& path,
                                         const OpenvslamPyramid& pyramid) {
  DatabaseReader reader(path);
  OpenvslamRecords records;
  read_cameras(reader, records);
  read_keyframes(reader, pyramid, records);
  read_associations(reader, records);
  read_landmarks(reader, records);
  return records;
}

}  // namespace waymark

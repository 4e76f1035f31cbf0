// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <array>
#include <cstring>
#include <fstream>

#include "waymark/base/check.h"
#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/base/text.h"
#include "waymark/exchange/openvslam_map.h"
#include "waymark/exchange/testing/openvslam_document.h"

namespace waymark {
namespace {

using testing::Document;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error_of;
using testing::SmallMap;

/// A document of MessagePack as the data base that the same program writes.
class DatabaseWriter {
 public:
  explicit DatabaseWriter(const std::filesystem::path& path) {
    EXPECT_EQ(sqlite3_open(path.c_str(), &base_), SQLITE_OK);
    run("PRAGMA synchronous=OFF; PRAGMA journal_mode=OFF; BEGIN");
    run("CREATE TABLE cameras(id INTEGER PRIMARY KEY, name BLOB, setup_type BLOB, model_type BLOB, "
        "color_type BLOB, cols INTEGER, rows INTEGER, fps REAL, fx REAL, fy REAL, cx REAL, cy "
        "REAL, "
        "k1 REAL, k2 REAL, p1 REAL, p2 REAL, k3 REAL, k4 REAL, focal_x_baseline REAL, "
        "distortion REAL);"
        "CREATE TABLE keyframes(id INTEGER PRIMARY KEY, src_frm_id INTEGER, ts REAL, cam BLOB, "
        "orb_params BLOB, pose_cw BLOB, n_keypts INTEGER, undist_keypts BLOB, x_rights BLOB, "
        "depths BLOB, descs BLOB, n_markers INTEGER, markers BLOB);"
        "CREATE TABLE landmarks(id INTEGER PRIMARY KEY, first_keyfrm INTEGER, pos_w BLOB, "
        "ref_keyfrm INTEGER, n_vis INTEGER, n_fnd INTEGER);"
        "CREATE TABLE associations(id INTEGER PRIMARY KEY, lm_ids BLOB, span_parent INTEGER, "
        "n_spanning_children INTEGER, spanning_children BLOB, n_loop_edges INTEGER, "
        "loop_edges BLOB);");
  }
  ~DatabaseWriter() {
    run("COMMIT");
    sqlite3_close(base_);
  }
  DatabaseWriter(const DatabaseWriter&) = delete;
  DatabaseWriter& operator=(const DatabaseWriter&) = delete;

  void run(const std::string& text) {
    EXPECT_EQ(sqlite3_exec(base_, text.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
        << sqlite3_errmsg(base_);
  }

  /// Values are numbers as they are, and blobs.
  void insert(const std::string& table, const Document& row) {
    std::string names, values;
    for (const auto& [name, value] : row.items()) {
      names += (names.empty() ? "" : ", ") + name;
      values += (values.empty() ? "" : ", ") + literal(value);
    }
    run("INSERT INTO " + table + "(" + names + ") VALUES(" + values + ")");
  }

  template <class T>
  static Document blob(const std::vector<T>& numbers) {
    std::vector<std::uint8_t> bytes(numbers.size() * sizeof(T));
    if (!bytes.empty()) std::memcpy(bytes.data(), numbers.data(), bytes.size());
    return Document::binary(bytes);
  }

 private:
  static std::string literal(const Document& value) {
    if (value.is_string()) return "'" + value.get<std::string>() + "'";
    if (!value.is_binary()) return value.dump();
    std::string text = "x'";
    for (const std::uint8_t byte : value.get_binary()) {
      constexpr const char* kDigits = "0123456789abcdef";
      text += {kDigits[byte >> 4], kDigits[byte & 15]};
    }
    return text + "'";
  }

  sqlite3* base_ = nullptr;
};

void insert_keyframe(DatabaseWriter& writer, const SmallMap& map, int id) {
  const Document& keyframe = map.document["keyframes"][std::to_string(id)];
  const Eigen::Matrix4d pose = map.cam_from_world[static_cast<std::size_t>(id)].matrix();
  std::vector<std::uint8_t> points;
  std::vector<std::uint32_t> words;
  for (const Document& point : keyframe["undist_keypts"]) {
    const std::array<float, 5> values = {
        point["pt"][0].get<float>(), point["pt"][1].get<float>(), 31.0f, 270.0f, 20.0f};
    const std::array<std::int32_t, 2> numbers = {point["oct"].get<std::int32_t>(), -1};
    const auto* first = reinterpret_cast<const std::uint8_t*>(values.data());
    points.insert(points.end(), first, first + sizeof values);
    const auto* second = reinterpret_cast<const std::uint8_t*>(numbers.data());
    points.insert(points.end(), second, second + sizeof numbers);
  }
  for (const Document& descriptor : keyframe["descs"]) {
    for (const Document& word : descriptor) words.push_back(word.get<std::uint32_t>());
  }
  writer.insert("keyframes",
                {{"id", id},
                 {"ts", keyframe["ts"]},
                 {"cam", "cam"},
                 {"orb_params", "orb"},
                 {"pose_cw", DatabaseWriter::blob<double>({pose.data(), pose.data() + 16})},
                 {"n_keypts", keyframe["n_keypts"]},
                 {"undist_keypts", Document::binary(points)},
                 {"descs", DatabaseWriter::blob(words)}});
  writer.insert(
      "associations",
      {{"id", id},
       {"lm_ids", DatabaseWriter::blob(keyframe["lm_ids"].get<std::vector<std::int32_t>>())},
       {"span_parent", id == 0 ? -1 : id - 1},
       {"loop_edges",
        DatabaseWriter::blob(keyframe["loop_edges"].get<std::vector<std::int32_t>>())}});
}

/// The small map as map.db.
void write_database(const SmallMap& map, const std::filesystem::path& path) {
  DatabaseWriter writer(path);
  Document camera = map.document["cameras"]["cam"];
  camera["id"] = 1;
  camera["name"] = "cam";
  camera["color_type"] = camera["color_order"];
  camera.erase("color_order");
  writer.insert("cameras", camera);
  for (int id = 0; id < 3; ++id) insert_keyframe(writer, map, id);
  for (std::size_t i = 0; i < map.points.size(); ++i) {
    const Eigen::Vector3d& point = map.points[i];
    writer.insert("landmarks",
                  {{"id", i},
                   {"first_keyfrm", 0},
                   {"pos_w", DatabaseWriter::blob<double>({point.x(), point.y(), point.z()})},
                   {"ref_keyfrm", 1},
                   {"n_vis", 9},
                   {"n_fnd", 5}});
  }
}

/// What landmarks and keyframes a map has, to compare.
std::string described(const Map& map) {
  std::string text;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    text += std::to_string(keyframe.timestamp_ns) + " " +
            std::to_string(keyframe.features->size()) + " " +
            std::to_string(keyframe.features->descriptors[4][1]) + "\n";
    for (const Keypoint& point : keyframe.features->keypoints) {
      text += std::to_string(point.x_px) + " " + std::to_string(point.level) + "\n";
    }
  });
  map.landmarks().for_each([&](LandmarkId, const Landmark& landmark) {
    text += std::to_string(landmark.position_in_world.x()) + " " +
            std::to_string(landmark.observations.size()) + " " +
            std::to_string(landmark.num_visible) + "\n";
  });
  return text + std::to_string(map.loop_edges().size());
}

TEST(OpenvslamDatabase, IsTheMapOfTheOtherFormat) {
  const SmallMap small = testing::make_small_map();
  const testing::TemporaryFolder folder;
  write_database(small, folder / "map.db");
  folder.write("map.msg", small.bytes());
  const ImportedMap expected = import_openvslam_file(folder / "map.msg");
  const ImportedMap imported = import_openvslam_file(folder / "map.db");
  EXPECT_EQ(imported.map.broken_invariants(), "");
  EXPECT_EQ(imported.map.keyframes().size(), 3u);
  EXPECT_EQ(described(imported.map), described(expected.map));
  EXPECT_THAT(imported.notes, ElementsAre(HasSubstr("is 8 levels of 1.2; --settings FILE")));
}

TEST(OpenvslamDatabase, TakesThePyramidFromTheSettings) {
  const testing::TemporaryFolder folder;
  write_database(testing::make_small_map(), folder / "map.db");
  const ConfigSource settings{"c.yaml", "Feature: {scale_factor: 1.44, num_levels: 8}\n"};
  const ImportedMap imported = import_openvslam_file(folder / "map.db", settings);
  const Features& features = *imported.map.keyframes().at(KeyframeId{0}).features;
  EXPECT_EQ(features.keypoints[3].level, 6);  // Two of our levels each.
  EXPECT_THAT(
      input_error_of([&] {
        import_openvslam_file(folder / "map.db", ConfigSource{"c.yaml", "Feature.num_levels: 4\n"});
      }),
      HasSubstr("expected a level below 4"));
}

TEST(OpenvslamDatabase, NamesWhatIsWrong) {
  const testing::TemporaryFolder folder;
  const auto error_after = [&](const std::string& change) {
    std::filesystem::remove(folder / "map.db");
    write_database(testing::make_small_map(), folder / "map.db");
    sqlite3* base = nullptr;
    sqlite3_open((folder / "map.db").c_str(), &base);
    sqlite3_exec(base, "PRAGMA synchronous=OFF", nullptr, nullptr, nullptr);
    EXPECT_EQ(sqlite3_exec(base, change.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
        << sqlite3_errmsg(base);
    sqlite3_close(base);
    return input_error_of([&] { import_openvslam_file(folder / "map.db"); });
  };
  EXPECT_THAT(error_after("DROP TABLE landmarks"), HasSubstr("no such table: landmarks"));
  EXPECT_THAT(error_after("DROP TABLE keyframes"), HasSubstr("expected an SQLite data base"));
  EXPECT_THAT(error_after("UPDATE keyframes SET n_keypts = 7 WHERE id = 1"),
              HasSubstr("keyframes.1: undist_keypts has 868 bytes, expected 196"));
  EXPECT_THAT(error_after("UPDATE keyframes SET n_keypts = 1000000000000 WHERE id = 1"),
              HasSubstr("n_keypts"));
  EXPECT_THAT(error_after("UPDATE keyframes SET pose_cw = zeroblob(128) WHERE id = 2"),
              HasSubstr("keyframes.2: pose_cw"));
  EXPECT_THAT(error_after("UPDATE keyframes SET pose_cw = NULL WHERE id = 2"),
              HasSubstr("pose_cw has 0 bytes, expected 128"));
  EXPECT_THAT(error_after("UPDATE keyframes SET cam = 'gone'"), HasSubstr("cam is 'gone'"));
  EXPECT_THAT(error_after("DELETE FROM associations WHERE id = 1"),
              HasSubstr("associations.1: is missing"));
  EXPECT_THAT(error_after("UPDATE landmarks SET pos_w = x'00' WHERE id = 3"),
              HasSubstr("landmarks.3: pos_w has 1 bytes, expected 24"));
  EXPECT_THAT(error_after("UPDATE associations SET span_parent = 2 WHERE id = 1"),
              HasSubstr("circle"));
  EXPECT_THAT(error_after("UPDATE cameras SET setup_type = 3"), HasSubstr("set-up '3'"));
  EXPECT_THAT(error_after("ALTER TABLE keyframes RENAME TO k; CREATE VIEW keyframes AS SELECT * "
                          "FROM k"),
              HasSubstr("expected an SQLite data base"));
}

TEST(OpenvslamDatabase, SurvivesTruncationAndFlippedBytes) {
  const testing::TemporaryFolder folder;
  write_database(testing::make_small_map(), folder / "whole.db");
  const std::string whole = read_text_file(folder / "whole.db", "");
  Rng rng(11, 0);
  int num_read = 0;
  for (int i = 0; i < 400; ++i) {
    std::string damaged = whole;
    if (i % 4 == 0) damaged.resize(16 + rng.below(static_cast<std::uint32_t>(whole.size() - 16)));
    for (int k = 0; k < 1 + i % 5; ++k) {
      damaged[16 + rng.below(static_cast<std::uint32_t>(damaged.size() - 16))] ^=
          static_cast<char>(1 + rng.below(255));
    }
    std::ofstream(folder / "damaged.db", std::ios::binary) << damaged;
    try {
      const ImportedMap imported = import_openvslam_file(folder / "damaged.db");
      EXPECT_EQ(imported.map.broken_invariants(), "");
      ++num_read;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
  }
  EXPECT_GT(num_read, 0);
}

}  // namespace
}  // namespace waymark

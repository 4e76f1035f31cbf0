// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// The real COLMAP reads it in tests/colmap_test.py.
#include "waymark/exchange/colmap_database.h"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include "waymark/base/check.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/base/text.h"
#include "waymark/exchange/testing/small_map.h"

namespace waymark {
namespace {

using testing::small_map;
using testing::TemporaryFolder;

/// The one number that a query gives.
std::int64_t ask(const std::filesystem::path& path, const std::string& query) {
  sqlite3* base = nullptr;
  sqlite3_open_v2(path.c_str(), &base, SQLITE_OPEN_READONLY, nullptr);
  std::int64_t number = -1;
  const auto take = [](void* result, int, char** values, char**) {
    *static_cast<std::int64_t*>(result) = values[0] ? std::stoll(values[0]) : -2;
    return 0;
  };
  EXPECT_EQ(sqlite3_exec(base, query.c_str(), take, &number, nullptr), SQLITE_OK) << query;
  sqlite3_close(base);
  return number;
}

/// The same views under other names.
ExportScene renamed(ExportScene scene, const std::string& prefix) {
  for (ExportView& view : scene.views) view.name = prefix + view.name;
  return scene;
}

TEST(ColmapDatabase, HoldsWhatTheModelHas) {
  const TemporaryFolder folder;
  const ExportScene scene = make_export_scene(small_map("distorted"), SubmapId{0});
  const auto file = folder / "database.db";
  {
    ColmapDatabase database(file);
    database.add(scene, {});
    database.add(renamed(scene, "other_"), {4, 2});
    database.finish();
  }
  EXPECT_EQ(ask(file, "SELECT count(*) FROM cameras"), 2);
  EXPECT_EQ(ask(file, "SELECT count(*) FROM images"), 6);
  EXPECT_EQ(ask(file, "SELECT camera_id FROM images WHERE image_id = 4"), 2);
  EXPECT_EQ(ask(file, "SELECT length(params) FROM cameras WHERE model = 6"), 12 * 8);
  EXPECT_EQ(ask(file, "SELECT rows FROM keypoints WHERE image_id = 1"), 31);
  EXPECT_EQ(ask(file, "SELECT length(data) FROM keypoints WHERE image_id = 1"), 31 * 8);
  // Three views of each model see 30 points each; views of two models have nothing in common.
  EXPECT_EQ(ask(file, "SELECT count(*) FROM two_view_geometries"), 6);
  EXPECT_EQ(ask(file,
                "SELECT rows FROM two_view_geometries WHERE pair_id = 4 * 2147483647 + 6 AND "
                "config = 2 AND length(E) = 72 AND length(qvec) = 32 AND length(tvec) = 24"),
            30);
}

TEST(UnlinkLooseViews, LeavesFeaturesToViewsThatShareEnough) {
  const ExportScene whole = make_export_scene(small_map("plain"), SubmapId{0});
  ExportScene scene = whole;
  unlink_loose_views(scene);
  EXPECT_EQ(scene.views[1].points, whole.views[1].points);
  // The last view sees few, and the points beyond number 20 are then seen by the first alone.
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    std::vector<ExportObservation>& observations = scene.points[i].observations;
    std::erase_if(observations, [&](const ExportObservation& seen) {
      return (seen.view == 2 && i >= 5 && i < 21) || (seen.view == 1 && i > 20);
    });
  }
  unlink_loose_views(scene);
  EXPECT_EQ(scene.points[3].observations.size(), 2u);
  EXPECT_EQ(scene.points[25].observations.size(), 0u);
  EXPECT_EQ(scene.points.size(), 30u);
  EXPECT_TRUE(scene.views[2].pixels.empty());
  EXPECT_EQ(scene.views[0].points[25], kNoPoint);
  EXPECT_EQ(scene.views[0].points[3], 3u);
}

TEST(ColmapDatabase, IsTheSameForTheSameScene) {
  const TemporaryFolder folder;
  const ExportScene scene = make_export_scene(small_map("plain"), SubmapId{0});
  for (const char* name : {"a.db", "b.db"}) {
    ColmapDatabase database(folder / name);
    database.add(scene, {});
    database.finish();
  }
  EXPECT_EQ(read_text_file(folder / "a.db", "a file"), read_text_file(folder / "b.db", "a file"));
}

TEST(ColmapDatabase, SaysWhenItCannotBeWritten) {
  const TemporaryFolder folder;
  EXPECT_THROW(ColmapDatabase(folder / "none/database.db"), OutputError);
}

}  // namespace
}  // namespace waymark

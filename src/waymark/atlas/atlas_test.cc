// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/atlas.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sqlite3.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <map>
#include <sstream>
#include <vector>

#include "waymark/atlas/add.h"
#include "waymark/atlas/export_atlas.h"
#include "waymark/atlas/optimize_atlas.h"
#include "waymark/atlas/testing/atlas.h"
#include "waymark/base/check.h"
#include "waymark/base/rng.h"
#include "waymark/geometry/alignment.h"

namespace waymark {
namespace {

namespace fs = std::filesystem;

std::string bytes_of(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << stream.rdbuf();
  return bytes.str();
}

/// All that an atlas says, as a text.
std::string describe(const Atlas& atlas) {
  std::ostringstream text;
  text.precision(17);
  for (const AtlasRecording& one : atlas.contents().recordings) text << one.checksum << "\n";
  for (const AtlasTile& tile : atlas.contents().tiles) {
    text << tile.origin << tile.checksum << tile.places << tile.frame << " "
         << tile.atlas_from_tile.rotation.coeffs().transpose() << " "
         << tile.atlas_from_tile.translation.transpose() << " " << tile.atlas_from_tile.scale
         << "\n";
  }
  for (const AtlasLink& link : atlas.contents().links) {
    text << link.a << " " << link.b << " " << link.num_shared << " "
         << link.b_from_a.translation.transpose() << "\n";
    for (const auto& [a, b] : atlas.read_shared(link)) text << a.value << " " << b.value << "\n";
  }
  return text.str();
}

enum class Units { kFree, kMetres, kFreeBetweenMetres, kMetresBetweenFree };

/// Three walks that overlap, in frames of their own.
std::vector<fs::path> save_walks(const fs::path& folder, Units units) {
  const bool is_metric = units == Units::kMetres || units == Units::kFreeBetweenMetres;
  const bool is_middle_metric = units == Units::kMetres || units == Units::kMetresBetweenFree;
  const double middle = is_middle_metric ? 1.0 : 1.7;
  const double last = is_metric || units == Units::kFree ? 1.0 : 0.6;
  return {
      save_walk(folder, "a", *walk_of_steps(0, 22, is_metric)),
      save_walk(folder, "b", *walk_of_steps(kRound + 14, kRound + 34, is_middle_metric, middle)),
      save_walk(folder, "c", *walk_of_steps(2 * kRound + 26, 2 * kRound + 46, is_metric, last))};
}

/// Root mean square distance of the keyframes of a map from where the walk has them, after one
/// motion, which scales what is not in metres. The frame of a keyframe is not its step once maps
/// are one: times would tell.
double error_of(const Map& map) {
  std::vector<Eigen::Vector3d> mapped, truth;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    mapped.push_back(keyframe.rig_from_world.origin_in_source());
    truth.push_back(LoopScene::true_pose(static_cast<int>(keyframe.timestamp_ns)).translation);
  });
  const Sim3 truth_from_map = is_metric(map) ? Sim3(align_rigid(mapped, truth).value())
                                             : align_similarity(mapped, truth).value();
  double sum = 0.0;
  for (std::size_t i = 0; i < mapped.size(); ++i) {
    sum += (truth_from_map * mapped[i] - truth[i]).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(mapped.size()));
}

TEST(AtlasTest, HoldsTheTilesOfAMap) {
  const fs::path folder = empty_folder("atlas_tiles");
  const std::vector<fs::path> maps = {save_walk(folder, "walk", *walk_of_steps(0, 34, true))};
  Atlas atlas = Atlas::open_or_create(folder / "atlas");
  EXPECT_TRUE(atlas.contents().tiles.empty());
  EXPECT_EQ(add_maps(atlas, maps, 10, 0).num_tiles, 4u);
  EXPECT_EQ(find_atlas_faults(folder / "atlas"), std::vector<std::string>());
  const Atlas again = Atlas::open(folder / "atlas");
  EXPECT_EQ(describe(again), describe(atlas));
  for (const AtlasTile& tile : again.contents().tiles) {
    EXPECT_EQ(tile.frame, 0u);
    EXPECT_LT((tile.atlas_from_tile.translation).norm(), 1e-12);
    EXPECT_EQ(again.load_tile(tile).map->keyframes().size(), tile.num_keyframes);
  }
  // A second time there is nothing to do.
  EXPECT_EQ(add_maps(atlas, maps, 10, 0).num_added, 0u);
  EXPECT_EQ(describe(atlas), describe(again));
}

class AtlasOfWalksTest : public ::testing::TestWithParam<Units> {};

TEST_P(AtlasOfWalksTest, IsOneMapInAnyOrder) {
  const fs::path folder =
      empty_folder("atlas_of_walks_" + std::to_string(static_cast<int>(GetParam())));
  const std::vector<fs::path> maps = save_walks(folder, GetParam());
  Atlas atlas = Atlas::open_or_create(folder / "atlas");
  const AddedMaps added = add_maps(atlas, maps, 12, 1);
  EXPECT_EQ(added.num_added, 3u);
  EXPECT_GE(added.num_links, 2u);
  for (const AtlasTile& tile : atlas.contents().tiles) EXPECT_EQ(tile.frame, 0u);
  EXPECT_EQ(find_atlas_faults(folder / "atlas"), std::vector<std::string>());
  const StoredMap whole = export_atlas(atlas);
  EXPECT_EQ(whole.map->broken_invariants(), "");
  EXPECT_EQ(is_metric(*whole.map), GetParam() != Units::kFree);
  EXPECT_EQ(whole.map->keyframes().size(), 62u);
  EXPECT_LT(error_of(*whole.map), 1e-6);

  Atlas other = Atlas::open_or_create(folder / "other");
  add_maps(other, std::array{maps[2], maps[0], maps[1]}, 12, 1);
  EXPECT_EQ(describe(other), describe(atlas));

  const std::size_t num_adjusted = optimize_atlas(atlas).num_adjusted;
  EXPECT_EQ(num_adjusted, atlas.contents().tiles.size());
  EXPECT_EQ(find_atlas_faults(folder / "atlas"), std::vector<std::string>());
  const double error = error_of(*export_atlas(atlas).map);
  // The walks are exact, but for the noise of what is seen, which the adjustment follows.
  EXPECT_LT(error, 0.01);
  optimize_atlas(other);
  EXPECT_EQ(describe(other), describe(atlas));
}

INSTANTIATE_TEST_SUITE_P(Scales,
                         AtlasOfWalksTest,
                         ::testing::Values(Units::kFree,
                                           Units::kMetres,
                                           Units::kFreeBetweenMetres,
                                           Units::kMetresBetweenFree));

TEST(AtlasTest, OptimizingStraightensWhatDrifted) {
  const fs::path folder = empty_folder("atlas_drift");
  const Vector7d drift = drift_of(0.3, 0.1, 0.0);
  // The middle walk meets both others at its ends, and bends between them.
  const std::vector<fs::path> maps = {
      save_walk(folder, "a", *walk_of_steps(0, 16, true)),
      save_walk(folder, "b", *walk_of_steps(kRound + 6, kRound + 34, true, 1.0, drift)),
      save_walk(folder, "c", *walk_of_steps(2 * kRound + 24, 2 * kRound + 46, true))};
  Atlas atlas = Atlas::open_or_create(folder / "atlas");
  add_maps(atlas, maps, 12, 1);
  const double before = error_of(*export_atlas(atlas).map);
  optimize_atlas(atlas);
  EXPECT_LT(error_of(*export_atlas(atlas).map), 0.8 * before);
}

TEST(AtlasTest, KeepsApartWhatDoesNotOverlap) {
  const fs::path folder = empty_folder("atlas_apart");
  const std::vector<fs::path> maps = {save_walk(folder, "a", *walk_of_steps(0, 4, true)),
                                      save_walk(folder, "b", *walk_of_steps(13, 17, true)),
                                      save_walk(folder, "c", *walk_of_steps(26, 30, false))};
  Atlas atlas = Atlas::open_or_create(folder / "atlas");
  EXPECT_EQ(add_maps(atlas, maps, 12, 0).num_links, 0u);
  EXPECT_EQ(export_atlas(atlas).map->submaps().size(), 3u);
}

TEST(AtlasTest, WhatComesLaterDoesNotMoveTheFrame) {
  const fs::path folder = empty_folder("atlas_later");
  const std::vector<fs::path> maps = save_walks(folder, Units::kMetres);
  Atlas atlas = Atlas::open_or_create(folder / "atlas");
  for (const fs::path& map : {maps[1], maps[0], maps[2]}) {
    add_maps(atlas, std::array{map}, 12, 1);
  }
  for (const AtlasTile& tile : atlas.contents().tiles) {
    EXPECT_EQ(tile.frame, 0u);
    if (atlas.contents().recordings[tile.recording].name != "b") continue;
    EXPECT_LT(tile.atlas_from_tile.translation.norm(), 0.05);
  }
}

TEST(AtlasTest, TwoWritersDoNotUndoEachOther) {
  const fs::path folder = empty_folder("atlas_writers");
  const std::vector<fs::path> maps = save_walks(folder, Units::kMetres);
  Atlas first = Atlas::open_or_create(folder / "atlas");
  Atlas second = Atlas::open(folder / "atlas");
  add_maps(first, std::array{maps[0]}, 12, 1);
  // The second one finds the atlas changed, and plans once more.
  EXPECT_EQ(add_maps(second, std::array{maps[1]}, 12, 1).num_added, 1u);
  EXPECT_EQ(second.contents().recordings.size(), 2u);
  // What is wanted of a state that is gone: its tiles have been adjusted, or are there already.
  optimize_atlas(second);
  EXPECT_EQ(add_maps(first, std::array{maps[1], maps[2]}, 12, 1).num_added, 1u);
  EXPECT_EQ(optimize_atlas(second).num_adjusted, first.contents().tiles.size());
  EXPECT_EQ(second.contents().recordings.size(), 3u);
  for (const AtlasTile& tile : second.contents().tiles) EXPECT_EQ(tile.frame, 0u);
  EXPECT_EQ(find_atlas_faults(folder / "atlas"), std::vector<std::string>());
}

TEST(AtlasTest, APlanFromAnOldStateIsNotCommitted) {
  const fs::path folder = empty_folder("atlas_old_plan");
  const std::vector<fs::path> maps = save_walks(folder, Units::kMetres);
  Atlas first = Atlas::open_or_create(folder / "atlas");
  Atlas second = Atlas::open(folder / "atlas");
  const StoredMap map = load_map(maps[0]);
  const std::string kept = second.store_tile(map);
  const fs::path path = second.tile_path(kept);
  add_maps(first, std::array{maps[0]}, 12, 1);
  EXPECT_TRUE(fs::exists(path)) << "what another one writes is his";
  EXPECT_FALSE(second.commit({}));
  EXPECT_EQ(describe(second), describe(first));
  EXPECT_EQ(describe(Atlas::open(folder / "atlas")), describe(first));
  EXPECT_TRUE(second.commit({second.contents(), {}}));
  second = Atlas::open(folder / "atlas");
  EXPECT_FALSE(fs::exists(path)) << "what no state refers to goes with its writer";
  EXPECT_FALSE(first.commit({first.contents(), {}}));
}

TEST(AtlasTest, LeftoversOfTheKilledGo) {
  const fs::path folder = empty_folder("atlas_leftovers");
  const std::vector<fs::path> maps = {save_walk(folder, "walk", *walk_of_steps(0, 12, true))};
  Atlas atlas = Atlas::open_or_create(folder / "atlas");
  const fs::path tiles = folder / "atlas" / "tiles";
  fs::create_directories(tiles / "new-abcdef");
  std::ofstream(tiles / "new-abcdef" / "tile") << "half";
  const fs::path unused = tiles / (std::string(64, 'a') + ".wmap");
  std::ofstream(unused) << "was to be listed next";
  Atlas::open_or_create(folder / "atlas");
  EXPECT_FALSE(fs::exists(tiles / "new-abcdef"));
  EXPECT_TRUE(fs::exists(unused)) << "it may be listed at any moment";
  add_maps(atlas, maps, 12, 1);
  EXPECT_FALSE(fs::exists(unused));
  EXPECT_EQ(find_atlas_faults(folder / "atlas"), std::vector<std::string>());
}

TEST(AtlasTest, DamagedTilesAreMadeAgain) {
  const fs::path folder = empty_folder("atlas_made_again");
  const std::vector<fs::path> maps = save_walks(folder, Units::kMetres);
  Atlas atlas = Atlas::open_or_create(folder / "atlas");
  add_maps(atlas, maps, 12, 1);
  const std::string before = describe(atlas);
  const AtlasTile tile = atlas.contents().tiles[0];
  fs::resize_file(atlas.tile_path(tile.checksum), 1000);
  fs::remove(atlas.places_path(atlas.contents().tiles[1].places));
  EXPECT_THROW(add_maps(atlas, maps, 24, 1), InputError) << "other tiles are of no use";
  EXPECT_EQ(add_maps(atlas, maps, 12, 1).num_restored, 2u);
  EXPECT_EQ(describe(atlas), before);
  EXPECT_EQ(find_atlas_faults(folder / "atlas"), std::vector<std::string>());
  // One that was adjusted comes back as it was cut.
  optimize_atlas(atlas);
  fs::remove(atlas.tile_path(atlas.contents().tiles[0].checksum));
  EXPECT_EQ(add_maps(atlas, maps, 12, 1).num_restored, 1u);
  EXPECT_EQ(atlas.contents().tiles[0].checksum, tile.origin);
  EXPECT_EQ(find_atlas_faults(folder / "atlas"), std::vector<std::string>());
}

/// A program that is killed while it writes leaves a journal, from which the next one, whatever it
/// wants, brings back the old state.
TEST(AtlasTest, TakesBackWhatAKilledWriterBegan) {
  const fs::path folder = empty_folder("atlas_killed");
  const std::vector<fs::path> maps = {save_walk(folder, "walk", *walk_of_steps(0, 12, true))};
  Atlas atlas = Atlas::open_or_create(folder / "atlas");
  add_maps(atlas, maps, 12, 1);
  const std::string before = describe(atlas);
  const std::string path = (folder / "atlas" / "atlas.db").string();
  const pid_t killed = fork();
  if (killed == 0) {
    sqlite3* base = nullptr;
    sqlite3_open(path.c_str(), &base);
    sqlite3_exec(base,
                 "PRAGMA cache_size=1; BEGIN; DELETE FROM tile; DELETE FROM recording; INSERT INTO "
                 "shared VALUES ('a', 'b', zeroblob(1000000)); SELECT count(*) FROM shared;",
                 nullptr,
                 nullptr,
                 nullptr);
    raise(SIGKILL);
  }
  waitpid(killed, nullptr, 0);
  ASSERT_TRUE(fs::exists(path + "-journal"));
  EXPECT_EQ(describe(Atlas::open(folder / "atlas")), before);
  EXPECT_FALSE(fs::exists(path + "-journal"));
  std::ofstream(path + "-journal", std::ios::binary)
      << std::string(600, 'x') << "\xd9\xd5\x05\xf9\x20\xa1\x63\xd7";
  EXPECT_THROW(Atlas::open(folder / "atlas"), InputError) << "it would remove another file";
}

TEST(AtlasTest, RefusesWhatIsNoAtlas) {
  const fs::path folder = empty_folder("atlas_none");
  EXPECT_THROW(Atlas::open(folder), InputError);
  std::ofstream(folder / "something") << "else";
  EXPECT_THROW(Atlas::open_or_create(folder), InputError);
  std::ofstream(folder / "atlas.db") << "nothing";
  EXPECT_THROW(Atlas::open(folder), InputError);
}

TEST(AtlasTest, NamesDamagedFiles) {
  const fs::path folder = empty_folder("atlas_damage");
  const std::vector<fs::path> maps = {save_walk(folder, "walk", *walk_of_steps(0, 12, true))};
  Atlas atlas = Atlas::open_or_create(folder / "atlas");
  add_maps(atlas, maps, 12, 0);
  const AtlasTile& tile = atlas.contents().tiles[0];
  for (const fs::path& path : {atlas.tile_path(tile.checksum), atlas.places_path(tile.places)}) {
    const std::string whole = bytes_of(path);
    std::string damaged = whole;
    damaged[damaged.size() / 2] ^= 1;
    std::ofstream(path, std::ios::binary) << damaged;
    EXPECT_FALSE(find_atlas_faults(folder / "atlas").empty());
    fs::remove(path);
    EXPECT_FALSE(find_atlas_faults(folder / "atlas").empty());
    std::ofstream(path, std::ios::binary) << whole;
    EXPECT_TRUE(find_atlas_faults(folder / "atlas").empty());
  }
}

/// Makes the atlas of one walk, for damage; the bytes of its data base.
std::string make_atlas_of_a_walk(const fs::path& folder) {
  Atlas atlas = Atlas::open_or_create(folder / "atlas");
  add_maps(atlas, std::array{save_walk(folder, "walk", *walk_of_steps(0, 20, true))}, 8, 0);
  return bytes_of(folder / "atlas" / "atlas.db");
}

/// Numbers that lead nowhere, and definitions that would be run.
TEST(AtlasTest, ReadsNoDataBaseThatWasChanged) {
  const fs::path folder = empty_folder("atlas_changes");
  const std::string whole = make_atlas_of_a_walk(folder);
  const fs::path path = folder / "atlas" / "atlas.db";
  for (const char* change :
       {"UPDATE tile SET frame = 16777216",
        "UPDATE tile SET frame = (SELECT count(*) FROM tile)",
        "UPDATE tile SET frame = 1 WHERE origin = (SELECT max(origin) FROM tile)",
        "UPDATE tile SET keyframes = 0",
        "UPDATE link SET b = a",
        "UPDATE shared SET landmarks = x'0000000000000001'",
        "ALTER TABLE state ADD COLUMN more AS (hex(zeroblob(9)))",
        "ALTER TABLE state ADD COLUMN more CHECK (length(hex(zeroblob(9))) > 0)",
        "CREATE INDEX more ON tile (length(hex(zeroblob(keyframes))))",
        "CREATE TABLE more (a)"}) {
    sqlite3* base = nullptr;
    sqlite3_open(path.c_str(), &base);
    ASSERT_EQ(sqlite3_exec(base, change, nullptr, nullptr, nullptr), SQLITE_OK)
        << sqlite3_errmsg(base);
    sqlite3_close(base);
    EXPECT_FALSE(find_atlas_faults(folder / "atlas").empty()) << change;
    EXPECT_THROW(export_atlas(Atlas::open(folder / "atlas")), InputError) << change;
    std::ofstream(path, std::ios::binary) << whole;
    EXPECT_TRUE(find_atlas_faults(folder / "atlas").empty());
  }
}

/// Whatever the bytes of the data base, reading it ends, with contents that fit or one line.
TEST(AtlasTest, ReadsNoDamagedDataBase) {
  const fs::path folder = empty_folder("atlas_mutations");
  const std::string whole = make_atlas_of_a_walk(folder);
  const fs::path path = folder / "atlas" / "atlas.db";
  const auto size = static_cast<std::uint32_t>(whole.size());
  Rng rng(5, 0);
  int num_refused = 0;
  for (int i = 0; i < 400; ++i) {
    std::string damaged = whole;
    if (i % 8 == 0) damaged.resize(rng.below(size));
    for (int k = 0; k <= i % 5 && !damaged.empty(); ++k) {
      damaged[rng.below(static_cast<std::uint32_t>(damaged.size()))] =
          static_cast<char>(rng.below(256));
    }
    std::ofstream(path, std::ios::binary) << damaged;
    try {
      const Atlas opened = Atlas::open(folder / "atlas");
      for (const AtlasLink& link : opened.contents().links) {
        ASSERT_LT(link.b, opened.contents().tiles.size());
        opened.read_shared(link);
      }
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      ++num_refused;
    }
  }
  EXPECT_GT(num_refused, 50);
}

}  // namespace
}  // namespace waymark

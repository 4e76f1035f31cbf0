// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "town_saving.h"

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "repeated_map.h"
#include "town_scene.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/mapfile/map_journal.h"

namespace waymark {
namespace {

std::filesystem::path temporary_file() {
  return std::filesystem::temp_directory_path() / ("waymark_town." + std::to_string(getpid()));
}

void save_town(benchmark::State& state) {
  const TownScene& scene = closed_scene(state);
  const StoredMap stored{.map = scene.town.map, .settings = {}, .images = {}};
  {
    const PeakCounter peak(state);
    for (auto _ : state) save_map(temporary_file(), stored);
  }
  state.counters["file_kb"] = static_cast<double>(std::filesystem::file_size(temporary_file())) /
                              1024.0 / static_cast<double>(state.range(0));
}

/// What autosaving costs when a map that was saved has become another.
void save_change(benchmark::State& state, void (*change)(Map&)) {
  const TownScene& scene = closed_scene(state);
  constexpr std::uint64_t kNoFileIsSmall = 0;
  MapJournal journal(temporary_file(), kNoFileIsSmall);
  journal.save({.map = scene.town.map, .settings = {}, .images = {}});
  Map map = Map::thaw(*scene.town.map);
  change(map);
  const StoredMap changed{.map = map.freeze(), .settings = {}, .images = {}};
  {
    const PeakCounter peak(state);
    for (auto _ : state) journal.save(changed);
  }
  std::filesystem::path changes = temporary_file();
  changes += ".journal";
  state.counters["saved_kb"] = static_cast<double>(std::filesystem::file_size(changes)) / 1024.0;
  std::filesystem::remove(changes);
}

void save_new_keyframes(benchmark::State& state) {
  save_change(state, [](Map& map) { repeat_last_keyframes(map, 100); });
}

/// As after a loop.
void save_moved_keyframes(benchmark::State& state) {
  save_change(state, [](Map& map) {
    MapCorrection correction = small_correction(map);
    for (MapCorrection::KeyframeMove& move : correction.keyframes) {
      move.rig_from_world.translation.x() += 1.0;
    }
    apply_correction(map, correction);
  });
}

/// After save_town().
void load_town(benchmark::State& state) {
  {
    const PeakCounter peak(state);
    for (auto _ : state) benchmark::DoNotOptimize(load_map(temporary_file()).map);
  }
  std::filesystem::remove(temporary_file());
}

}  // namespace

void register_saving_steps(std::int64_t num_keyframes) {
  add_step("all/save", save_town, num_keyframes, 1);
  add_step("one/save_new", save_new_keyframes, num_keyframes, 1);
  add_step("all/save_moved", save_moved_keyframes, num_keyframes, 1);
  add_step("all/load", load_town, num_keyframes, 1);
}

}  // namespace waymark

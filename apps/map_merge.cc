// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "map_tasks.h"
#include "waymark/loop/map_merger.h"
#include "waymark/mapfile/map_file.h"

namespace waymark {
namespace {

struct MergeOptions {
  std::filesystem::path a;
  std::filesystem::path b;
  std::filesystem::path out;
  std::uint64_t seed = 0;
};

std::size_t count_parts(const Map& map) {
  std::size_t count = 0;
  for (const Submap& submap : map.submaps()) count += submap.root.is_valid();
  return count;
}

/// Whether each map has a sub-map in metres where the other has none, so that nothing was compared.
bool are_of_different_units(const Map& a, const Map& b) {
  const auto has = [](const Map& map, bool is_metric) {
    for (const Submap& submap : map.submaps()) {
      if (submap.root.is_valid() && submap.is_metric == is_metric) return true;
    }
    return false;
  };
  return !(has(a, true) && has(b, true)) && !(has(a, false) && has(b, false));
}

void report(const MergeOptions& options,
            const StoredMap& a,
            const StoredMap& b,
            const MergedMaps& merged) {
  const std::size_t num_before = count_parts(*a.map) + count_parts(*b.map);
  const std::size_t num_after = count_parts(*merged.map);
  if (merged.num_joins == 0) {
    fmt::print("{} and {}: no overlap found, kept as {} separate sub-maps\n",
               options.a.string(),
               options.b.string(),
               num_after);
    if (are_of_different_units(*a.map, *b.map)) {
      fmt::print("one is in metres, the scale of the other is free: map align makes it metres\n");
    }
  } else {
    fmt::print("joined: {} sub-maps are {} now, {} further places were seen in both\n",
               num_before,
               num_after,
               merged.num_loops);
  }
  fmt::print("{}: {} keyframes, {} landmarks, {} sub-map{}\n",
             options.out.string(),
             merged.map->keyframes().size(),
             merged.map->landmarks().size(),
             num_after,
             num_after == 1 ? "" : "s");
}

int merge_files(const MergeOptions& options) {
  const StoredMap a = load_map(options.a);
  const StoredMap b = load_map(options.b);
  const MergedMaps merged = merge_maps(*a.map, *b.map, options.seed);
  StoredMap stored = a;
  stored.map = merged.map;
  for (const auto& [id, jpeg] : b.images) {
    stored.images.emplace(KeyframeId{id.value + a.map->keyframes().end_id().value}, jpeg);
  }
  save_map(options.out, stored);
  report(options, a, b, merged);
  return kDone;
}

}  // namespace

void add_merge_task(CLI::App& maps, Command& command) {
  const auto options = std::make_shared<MergeOptions>();
  CLI::App& merge = *maps.add_subcommand(
      "merge", "Put two maps into one file and join what shows the same places");
  merge.add_option("A", options->a, "Map file (.wmap); the result is in its frame")->required();
  merge.add_option("B", options->b, "Map file (.wmap)")->required();
  merge.add_option("-o,--out", options->out, "Map file to write")->required();
  merge.add_option("--seed", options->seed, "Of random numbers [0]");
  merge.callback([options, &command] { command = [options] { return merge_files(*options); }; });
}

}  // namespace waymark

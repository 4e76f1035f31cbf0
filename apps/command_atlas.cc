// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "commands.h"
#include "paths.h"
#include "terminal.h"
#include "waymark/atlas/add.h"
#include "waymark/atlas/atlas.h"
#include "waymark/atlas/export_atlas.h"
#include "waymark/atlas/optimize_atlas.h"
#include "waymark/base/check.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

void say_step(const std::string& what) { print_message("{}\n", what); }

void print_atlas_recordings(const AtlasContents& contents) {
  for (std::uint32_t i = 0; i < contents.recordings.size(); ++i) {
    std::size_t num_tiles = 0, num_keyframes = 0;
    std::vector<std::uint32_t> frames;
    for (const AtlasTile& tile : contents.tiles) {
      if (tile.recording != i) continue;
      ++num_tiles;
      num_keyframes += tile.num_keyframes;
      frames.push_back(tile.frame);
    }
    std::ranges::sort(frames);
    frames.erase(std::unique(frames.begin(), frames.end()), frames.end());
    print_result("recording {}: {}, {}, {} {}\n",
                 printable(contents.recordings[i].name),
                 count_of(num_tiles, "tile"),
                 count_of(num_keyframes, "keyframe"),
                 frames.size() == 1 ? "part" : "parts",
                 fmt::join(frames, ", "));
  }
}

int optimize_folder(const std::filesystem::path& folder) {
  Atlas atlas = Atlas::open(folder);
  const OptimizedAtlas optimized = optimize_atlas(atlas, say_step);
  print_result("{}: {} of {} adjusted\n",
               folder.string(),
               optimized.num_adjusted,
               count_of(atlas.contents().tiles.size(), "tile"));
  return kDone;
}

void add_atlas_task(CLI::App& atlases,
                    const char* name,
                    const char* help,
                    int (*task)(const std::filesystem::path&),
                    Command& command) {
  const auto path = std::make_shared<std::filesystem::path>();
  CLI::App& added = *atlases.add_subcommand(name, help);
  reads(added.add_option("ATLAS", *path, "Folder of an atlas"))->required();
  added.callback([path, task, &command] { command = [path, task] { return task(*path); }; });
}

struct AddOptions {
  std::filesystem::path atlas;
  std::vector<std::filesystem::path> maps;
  std::size_t num_keyframes = kKeyframesPerTile;
  std::uint64_t seed = 0;
};

int add_to_folder(const AddOptions& options) {
  for (const std::filesystem::path& map : options.maps) {
    if (std::filesystem::is_regular_file(map)) continue;
    throw InputError(map.string(), "missing, expected a map file");
  }
  Atlas atlas = Atlas::open_or_create(options.atlas);
  const AddedMaps added =
      add_maps(atlas, options.maps, options.num_keyframes, options.seed, say_step);
  print_result("{}: {} added with {}; {} of {} pairs of tiles show the same place\n",
               options.atlas.string(),
               count_of(added.num_added, "map"),
               count_of(added.num_tiles, "tile"),
               added.num_links,
               added.num_pairs);
  return kDone;
}

void add_adding_task(CLI::App& atlases, Command& command) {
  const auto options = std::make_shared<AddOptions>();
  CLI::App& task = *atlases.add_subcommand(
      "add", "Cut maps into tiles, find what they share with those there, and put them in place");
  writes(task.add_option("ATLAS", options->atlas, "Folder of an atlas; made if it is missing"))
      ->required();
  reads(task.add_option("MAP", options->maps, "Map files (.wmap)"))->required();
  add_tile_size_option(task, options->num_keyframes);
  task.add_option("--seed", options->seed, "Of random numbers [0]");
  task.callback([options, &command] { command = [options] { return add_to_folder(*options); }; });
}

struct ExportAtlasOptions {
  std::filesystem::path atlas;
  std::filesystem::path out;
};

int export_folder(const ExportAtlasOptions& options) {
  const StoredMap stored = export_atlas(Atlas::open(options.atlas));
  save_map(options.out, stored);
  print_result("{}: {}, {}\n",
               options.out.string(),
               count_of(stored.map->keyframes().size(), "keyframe"),
               count_of(stored.map->landmarks().size(), "landmark"));
  return kDone;
}

void add_atlas_export_task(CLI::App& atlases, Command& command) {
  const auto options = std::make_shared<ExportAtlasOptions>();
  CLI::App& task = *atlases.add_subcommand("export", "Write all of an atlas as one map");
  reads(task.add_option("ATLAS", options->atlas, "Folder of an atlas"))->required();
  writes(task.add_option("-o,--out", options->out, "Map file to write (.wmap)"))->required();
  task.callback([options, &command] { command = [options] { return export_folder(*options); }; });
}

}  // namespace

int print_atlas_info(const std::filesystem::path& folder) {
  const Atlas atlas = Atlas::open(folder);
  const AtlasContents& contents = atlas.contents();
  print_atlas_recordings(contents);
  std::uint32_t num_parts = 0;
  std::uint64_t num_keyframes = 0, num_landmarks = 0;
  for (const AtlasTile& tile : contents.tiles) {
    num_parts = std::max(num_parts, tile.frame + 1);
    num_keyframes += tile.num_keyframes;
    num_landmarks += tile.num_landmarks;
  }
  const auto num_borders =
      static_cast<std::size_t>(std::ranges::count(contents.links, true, &AtlasLink::is_border));
  print_result("{}: {}, {}, {}, {}, {}\n",
               folder.string(),
               count_of(contents.recordings.size(), "recording"),
               count_of(contents.tiles.size(), "tile"),
               count_of(num_keyframes, "keyframe"),
               count_of(num_landmarks, "landmark"),
               count_of(num_parts, "connected part"));
  print_result("{} within recordings, {} that several show\n",
               count_of(num_borders, "border"),
               count_of(contents.links.size() - num_borders, "place"));
  return kDone;
}

int check_atlas(const std::filesystem::path& folder) {
  const std::vector<std::string> faults = find_atlas_faults(folder);
  for (const std::string& fault : faults) print_result("{}\n", fault);
  if (!faults.empty()) {
    throw InputError(folder.string(), fmt::format("has {} faults, expected none", faults.size()));
  }
  print_result("{}: sound\n", folder.string());
  return kDone;
}

void add_tile_size_option(CLI::App& command, std::size_t& num_keyframes) {
  command
      .add_option("--keyframes",
                  num_keyframes,
                  fmt::format("Most keyframes of a tile, {} to {} [{}]",
                              kMinKeyframesPerTile,
                              kMaxKeyframesPerTile,
                              kKeyframesPerTile))
      ->check(CLI::Range(kMinKeyframesPerTile, kMaxKeyframesPerTile))
      ->type_name("N");
}

void add_atlas_command(CLI::App& program, Command& command) {
  CLI::App& atlases = *program.add_subcommand("atlas", "Make one map of many recordings, in tiles");
  atlases.require_subcommand(1);
  add_adding_task(atlases, command);
  add_atlas_task(atlases, "info", "Print what an atlas holds", print_atlas_info, command);
  add_atlas_task(atlases, "check", "Name everything that is wrong", check_atlas, command);
  add_atlas_task(atlases,
                 "optimize",
                 "Put tiles where links say, and adjust each among the others",
                 optimize_folder,
                 command);
  add_atlas_export_task(atlases, command);
}

}  // namespace waymark

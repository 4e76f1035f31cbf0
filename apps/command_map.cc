// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "commands.h"
#include "paths.h"
#include "terminal.h"
#include "waymark/atlas/add.h"
#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/session/merging.h"

namespace waymark {
namespace {

/// What a sub-map holds.
struct SubmapSize {
  std::size_t num_keyframes = 0;
  std::size_t num_landmarks = 0;
};

std::vector<SubmapSize> measure_submaps(const Map& map) {
  std::vector<SubmapSize> sizes(map.submaps().size());
  map.keyframes().for_each(
      [&](KeyframeId, const Keyframe& keyframe) { ++sizes[keyframe.submap.value].num_keyframes; });
  map.landmarks().for_each(
      [&](LandmarkId, const Landmark& landmark) { ++sizes[landmark.submap.value].num_landmarks; });
  return sizes;
}

void print_submaps(const Map& map) {
  const std::vector<SubmapSize> sizes = measure_submaps(map);
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const Submap& submap = map.submaps()[i];
    if (submap.joined_into.is_valid()) {
      print_result("sub-map {}: joined into sub-map {}\n", i, submap.joined_into.value);
    } else {
      print_result("sub-map {}: {}, {}, {}\n",
                   i,
                   count_of(sizes[i].num_keyframes, "keyframe"),
                   count_of(sizes[i].num_landmarks, "landmark"),
                   submap.is_metric ? "in metres" : "scale free");
    }
  }
}

void print_rigs(const Map& map) {
  std::vector<const Rig*> rigs;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    const Rig* rig = keyframe.features->rig.get();
    if (std::find(rigs.begin(), rigs.end(), rig) == rigs.end()) rigs.push_back(rig);
  });
  for (std::size_t i = 0; i < rigs.size(); ++i) {
    for (std::size_t j = 0; j < rigs[i]->cameras.size(); ++j) {
      const CameraDescription& camera = rigs[i]->cameras[j].description.value();
      const bool is_known = rigs[i]->cameras[j].camera->can_project();
      print_result("rig {}, camera {}: {}{}, distortion {}, {}x{} px\n",
                   i,
                   j,
                   camera.camera_model,
                   is_known ? "" : " (unknown model)",
                   camera.distortion_model,
                   camera.width_px,
                   camera.height_px);
    }
  }
}

int print_info(const std::filesystem::path& path) {
  if (is_atlas(path)) return print_atlas_info(path);
  const StoredMap stored = load_map(path);
  const Map& map = *stored.map;
  const auto num_bytes = static_cast<double>(std::filesystem::file_size(path));
  print_result("{}: written by {}, {:.1f} MB\n",
               path.string(),
               printable(stored.producer),
               1e-6 * num_bytes);
  print_rigs(map);
  print_submaps(map);
  print_result("{}, {}, {}, {}\n",
               count_of(map.keyframes().size(), "keyframe"),
               count_of(map.landmarks().size(), "landmark"),
               count_of(map.measured_loop_edges().size(), "loop edge"),
               count_of(stored.images.size(), "image"));
  return kDone;
}

int check_map(const std::filesystem::path& path) {
  if (is_atlas(path)) return check_atlas(path);
  const std::vector<std::string> faults = find_map_faults(path);
  for (const std::string& fault : faults) print_result("{}\n", fault);
  if (!faults.empty()) {
    throw InputError(path.string(), "has " + count_of(faults.size(), "fault") + ", expected none");
  }
  print_result("{}: sound\n", path.string());
  return kDone;
}

void add_task(CLI::App& maps,
              const char* name,
              const char* help,
              int (*task)(const std::filesystem::path&),
              Command& command) {
  const auto path = std::make_shared<std::filesystem::path>();
  CLI::App& added = *maps.add_subcommand(name, help);
  reads(added.add_option("MAP", *path, "Map file (.wmap), or folder of an atlas"))->required();
  added.callback([path, task, &command] { command = [path, task] { return task(*path); }; });
}

struct MergeOptions {
  std::filesystem::path a;
  std::filesystem::path b;
  std::filesystem::path out;
  std::uint64_t seed = 0;
};

void report(const MergeOptions& options, const MergedStored& merged) {
  if (merged.num_joins == 0) {
    print_result("{} and {}: no overlap found, kept as {} separate sub-maps\n",
                 options.a.string(),
                 options.b.string(),
                 merged.num_parts);
    if (merged.is_incomparable) {
      print_result("one is in metres, the scale of the other is free: map align makes it metres\n");
    }
  } else {
    print_result("joined: {} sub-maps are {} now, {} seen in both\n",
                 merged.num_parts_before,
                 merged.num_parts,
                 count_of(merged.num_loops, "further place"));
  }
  print_result("{}: {}, {}, {}\n",
               options.out.string(),
               count_of(merged.stored.map->keyframes().size(), "keyframe"),
               count_of(merged.stored.map->landmarks().size(), "landmark"),
               count_of(merged.num_parts, "sub-map"));
}

int merge_files(const MergeOptions& options) {
  const MergedStored merged = merge_stored(load_map(options.a), load_map(options.b), options.seed);
  save_map(options.out, merged.stored);
  report(options, merged);
  return kDone;
}

void add_merge_task(CLI::App& maps, Command& command) {
  const auto options = std::make_shared<MergeOptions>();
  CLI::App& merge = *maps.add_subcommand(
      "merge", "Put two maps into one file and join what shows the same places");
  reads(merge.add_option("A", options->a, "Map file (.wmap); the result is in its frame"))
      ->required();
  reads(merge.add_option("B", options->b, "Map file (.wmap)"))->required();
  writes(merge.add_option("-o,--out", options->out, "Map file to write"))->required();
  merge.add_option("--seed", options->seed, "Of random numbers [0]");
  merge.callback([options, &command] { command = [options] { return merge_files(*options); }; });
}

struct TileOptions {
  std::filesystem::path map;
  std::filesystem::path out;
  std::size_t num_keyframes = kKeyframesPerTile;
};

int tile_map(const TileOptions& options) {
  const std::string checksum = checksum_of_map(options.map);
  Atlas atlas = Atlas::open_or_create(options.out);
  for (const AtlasRecording& recording : atlas.contents().recordings) {
    if (recording.checksum == checksum) continue;
    throw InputError(options.out.string(),
                     "holds another map; waymark atlas add finds what they share");
  }
  add_maps(atlas, std::span(&options.map, 1), options.num_keyframes, /*seed=*/0);
  print_result("{}: {}\n", options.out.string(), count_of(atlas.contents().tiles.size(), "tile"));
  return kDone;
}

void add_tile_task(CLI::App& maps, Command& command) {
  const auto options = std::make_shared<TileOptions>();
  CLI::App& tile = *maps.add_subcommand("tile", "Cut a map into the tiles of an atlas");
  reads(tile.add_option("MAP", options->map, "Map file (.wmap)"))->required();
  writes(tile.add_option("-o,--out", options->out, "Folder for the atlas"))->required();
  add_tile_size_option(tile, options->num_keyframes);
  tile.callback([options, &command] { command = [options] { return tile_map(*options); }; });
}

}  // namespace

void add_map_command(CLI::App& program, Command& command) {
  CLI::App& maps =
      *program.add_subcommand("map", "Look at, verify, join, scale and level, or cut saved maps");
  maps.require_subcommand(1);
  add_task(maps, "info", "Print what a map holds", print_info, command);
  add_task(maps, "check", "Name everything that is wrong with a map", check_map, command);
  add_merge_task(maps, command);
  add_align_task(maps, command);
  add_tile_task(maps, command);
}

}  // namespace waymark

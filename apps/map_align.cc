// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "commands.h"
#include "paths.h"
#include "terminal.h"
#include "waymark/base/check.h"
#include "waymark/exchange/align_map.h"
#include "waymark/mapfile/map_file.h"

namespace waymark {
namespace {

struct AlignOptions {
  std::filesystem::path map;
  std::filesystem::path out;
  std::vector<std::tuple<std::string, std::string, double>> distances;
  std::filesystem::path trajectory;
  std::vector<double> up;
};

/// 12: keyframe 12; L12: landmark 12.
MapPlace parse_place(const std::string& text) {
  const bool is_landmark = text.starts_with('L');
  const char* const begin = text.data() + is_landmark;
  const char* const end = text.data() + text.size();
  std::uint32_t id = 0;
  const auto [stop, error] = std::from_chars(begin, end, id);
  if (error != std::errc() || stop != end) {
    throw InputError(
        "--distance",
        fmt::format("'{}' is no place, expected the id of a keyframe, or L and that of a landmark",
                    text));
  }
  if (is_landmark) return LandmarkId{id};
  return KeyframeId{id};
}

AlignedMap align_as_asked(const Map& map, const AlignOptions& options) {
  if (!options.distances.empty()) {
    std::vector<KnownDistance> known;
    for (const auto& [a, b, metres] : options.distances) {
      known.push_back({parse_place(a), parse_place(b), metres});
    }
    return align_to_distances(map, known, "--distance");
  }
  if (!options.trajectory.empty()) {
    return align_to_trajectory(
        map, read_trajectory(options.trajectory), options.trajectory.string());
  }
  return align_upright(map, {options.up[0], options.up[1], options.up[2]}, "--up");
}

int align(const AlignOptions& options) {
  const int num_ways =
      !options.distances.empty() + !options.trajectory.empty() + !options.up.empty();
  if (num_ways != 1) {
    throw InputError("map align",
                     "expected one of --distance ID_A ID_B METRES, --trajectory FILE, --up X,Y,Z");
  }
  StoredMap stored = load_map(options.map);
  AlignedMap aligned = align_as_asked(*stored.map, options);
  for (const std::string& line : aligned.report) print_result("{}\n", line);
  stored.map = aligned.map.freeze();
  if (stored.imu) stored.imu->gravity_in_world.setZero();  // In another frame now.
  save_map(options.out, stored);
  return kDone;
}

}  // namespace

void add_align_task(CLI::App& maps, Command& command) {
  const auto options = std::make_shared<AlignOptions>();
  CLI::App& added =
      *maps.add_subcommand("align", "Scale a map, level it, or put it where a trajectory is");
  reads(added.add_option("MAP", options->map, "Map file (.wmap)"))->required();
  writes(added.add_option("-o,--out", options->out, "Map file to write"))->required();
  added
      .add_option("--distance",
                  options->distances,
                  "ID_A ID_B METRES: how far apart two keyframes are, or landmarks (L and the id); "
                  "may be repeated")
      ->type_size(3);
  reads(added.add_option(
      "--trajectory", options->trajectory, "Poses of camera 0 (TUM, EuRoC csv, KITTI)"));
  added.add_option("--up", options->up, "X,Y,Z: what is up in the largest sub-map; becomes +z")
      ->delimiter(',')
      ->expected(3);
  added.callback([options, &command] { command = [options] { return align(*options); }; });
}

}  // namespace waymark

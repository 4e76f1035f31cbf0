// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "commands.h"
#include "terminal.h"
#include "waymark/base/check.h"
#include "waymark/exchange/trajectory.h"
#include "waymark/map/align.h"
#include "waymark/map/parts.h"
#include "waymark/mapfile/map_file.h"

namespace waymark {
namespace {

constexpr std::int64_t kMaxDifferenceNs = 20'000'000;
constexpr double kMaxDistanceM = 1e6;  // Of keyframes whose distance is known.
constexpr double kMaxFactor = 1e6;
constexpr double kMaxPositionM = 1e9;  // Of poses of a trajectory: on Earth, in any frame.

struct AlignOptions {
  std::filesystem::path map;
  std::filesystem::path out;
  std::vector<std::tuple<std::uint32_t, std::uint32_t, double>> distances;
  std::filesystem::path trajectory;
  std::vector<double> up;
};

SubmapId submap_of(const Map& map, std::uint32_t id) {
  const Keyframe* keyframe = map.keyframes().find(KeyframeId{id});
  if (!keyframe) {
    throw InputError("--distance",
                     fmt::format("names keyframe {}, which is not there, expected the id of one "
                                 "of the map's {}",
                                 id,
                                 map.keyframes().size()));
  }
  return keyframe->submap;
}

/// Beyond this the numbers of maps, or their meaning, would suffer.
void check_factor(const std::string& where, double factor) {
  if (factor >= 1.0 / kMaxFactor && factor <= kMaxFactor) return;
  throw InputError(where,
                   fmt::format("would scale the map by {:.6g}, expected {:g} to {:g}",
                               factor,
                               1.0 / kMaxFactor,
                               kMaxFactor));
}

Map scale(Map map, const AlignOptions& options) {
  std::optional<SubmapId> submap;
  std::vector<KnownDistance> known;
  for (const auto& [a, b, metres] : options.distances) {
    for (const std::uint32_t id : {a, b}) {
      if (submap.value_or(submap_of(map, id)) != submap_of(map, id)) {
        throw InputError("--distance", "names keyframes of several sub-maps, expected one sub-map");
      }
      submap = submap_of(map, id);
    }
    if (!(metres > 0.0 && metres <= kMaxDistanceM)) {
      throw InputError(
          "--distance",
          fmt::format("is {} m, expected more than 0 and at most {:.0f}", metres, kMaxDistanceM));
    }
    known.push_back({KeyframeId{a}, KeyframeId{b}, metres});
  }
  if (has_measured_ranges(map, *submap)) {
    throw InputError("--distance",
                     fmt::format("is for sub-map {}, in which stereo or depth measured lengths, "
                                 "expected one whose scale is free",
                                 submap->value));
  }
  const std::optional<double> factor = scale_by_distances(map, known);
  if (!factor)
    throw InputError("--distance", "is between keyframes at the same place, expected two");
  check_factor("--distance", *factor);
  print_result("sub-map {}: scaled by {:.6g}, now in metres\n", submap->value, *factor);
  return put_into_metres(
      std::move(map), *submap, {Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero(), *factor});
}

Map fit(Map map, const AlignOptions& options) {
  std::vector<std::int64_t> timestamps_ns;
  std::vector<Rigid3> poses;
  for (const StampedPose& pose : read_trajectory(options.trajectory)) {
    const double farthest_m = pose.world_from_camera.translation.cwiseAbs().maxCoeff();
    if (!(farthest_m <= kMaxPositionM)) {
      throw InputError(
          options.trajectory.string(),
          fmt::format("has a pose {:g} m away, expected at most {:g}", farthest_m, kMaxPositionM));
    }
    timestamps_ns.push_back(pose.timestamp_ns);
    poses.push_back(pose.world_from_camera);
  }
  std::string report;
  bool has_fit = false;
  for (const auto& [submap, found] : fit_submaps(map, {timestamps_ns, poses}, kMaxDifferenceNs)) {
    has_fit = has_fit || found;
    if (found) check_factor(options.trajectory.string(), found->trajectory_from_map.scale);
    report +=
        found
            ? fmt::format(
                  "sub-map {}: {} keyframes with a pose, {:.3g} m rms off, scaled by {:.6g}\n",
                  submap.value,
                  found->num_keyframes,
                  found->rms_m,
                  found->trajectory_from_map.scale)
            : fmt::format(
                  "sub-map {}: stays as it is, no three of its keyframes off a line have a pose\n",
                  submap.value);
  }
  if (!has_fit) {
    throw InputError(options.trajectory.string(),
                     "has no poses at the times of keyframes, expected three or more, not all on a "
                     "line, within 0.02 s");
  }
  print_result("{}", report);
  return map;
}

Map level(Map map, const AlignOptions& options) {
  const Eigen::Vector3d up(options.up[0], options.up[1], options.up[2]);
  const double length = up.stableNorm();
  if (!(length > 1.0 / kMaxFactor && length < kMaxFactor)) {
    throw InputError("--up", "is no direction, expected three numbers, not all 0, below 1000000");
  }
  const std::vector<SubmapId> submaps = submaps_by_size(map);
  if (submaps.empty()) throw InputError(options.map.string(), "has no keyframes, expected some");
  print_result("sub-map {}: {} {} {} is +z now\n", submaps[0].value, up.x(), up.y(), up.z());
  for (std::size_t i = 1; i < submaps.size(); ++i) {
    print_result("sub-map {}: stays as it is, having a frame of its own\n", submaps[i].value);
  }
  transform_submap(map, submaps[0], {turn_upright(up), Eigen::Vector3d::Zero(), 1.0});
  return map;
}

int align(const AlignOptions& options) {
  const int num_ways =
      !options.distances.empty() + !options.trajectory.empty() + !options.up.empty();
  if (num_ways != 1) {
    throw InputError("map align",
                     "expected one of --distance ID_A ID_B METRES, --trajectory FILE, --up X,Y,Z");
  }
  StoredMap stored = load_map(options.map);
  Map map = Map::thaw(*stored.map);
  if (!options.distances.empty()) {
    map = scale(std::move(map), options);
  } else if (!options.trajectory.empty()) {
    map = fit(std::move(map), options);
  } else {
    map = level(std::move(map), options);
  }
  stored.map = map.freeze();
  save_map(options.out, stored);
  return kDone;
}

}  // namespace

void add_align_task(CLI::App& maps, Command& command) {
  const auto options = std::make_shared<AlignOptions>();
  CLI::App& added =
      *maps.add_subcommand("align", "Scale a map, level it, or put it where a trajectory is");
  added.add_option("MAP", options->map, "Map file (.wmap)")->required();
  added.add_option("-o,--out", options->out, "Map file to write")->required();
  added
      .add_option("--distance",
                  options->distances,
                  "ID_A ID_B METRES: how far apart two keyframes are; may be repeated")
      ->type_size(3);
  added.add_option(
      "--trajectory", options->trajectory, "Poses of camera 0 (TUM, EuRoC csv, KITTI)");
  added.add_option("--up", options->up, "X,Y,Z: what is up in the largest sub-map; becomes +z")
      ->delimiter(',')
      ->expected(3);
  added.callback([options, &command] { command = [options] { return align(*options); }; });
}

}  // namespace waymark

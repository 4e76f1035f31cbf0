// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "commands.h"
#include "terminal.h"
#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/exchange/export_folder.h"
#include "waymark/exchange/export_scene.h"
#include "waymark/exchange/export_split.h"
#include "waymark/exchange/exports.h"
#include "waymark/map/parts.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/marker/known_markers.h"

namespace waymark {
namespace {

enum class ExportFormat { kPly, kColmap, kNerfstudio, kTum, kKitti, kMarkers };

struct ExportOptions {
  std::filesystem::path map;
  std::filesystem::path out;
  ExportFormat format = ExportFormat::kPly;
  bool is_text = false;
  int split_views = 0;  ///< 0: as they are.
};

bool makes_folder(ExportFormat format) {
  return format == ExportFormat::kColmap || format == ExportFormat::kNerfstudio;
}

/// "points.ply", "points_1.ply" and so on.
std::filesystem::path numbered(std::filesystem::path path, std::size_t number) {
  if (number == 0) return path;
  return path.replace_filename(
      fmt::format("{}_{}{}", path.stem().string(), number, path.extension().string()));
}

void write_nerfstudio(const std::filesystem::path& folder,
                      const ExportScene& scene,
                      std::size_t number) {
  NerfstudioPaths paths;
  paths.point_file = numbered(paths.point_file, number).string();
  const std::string json = format_nerfstudio(scene, paths);  // Before anything is written.
  make_output_folder(folder);
  write_ply(folder / paths.point_file, scene);
  write_file_atomically(folder / numbered("transforms.json", number), json);
}

/// A model for COLMAP or nerfstudio, with images.
void export_model(const ExportOptions& options,
                  const StoredMap& stored,
                  ExportScene scene,
                  std::size_t number) {
  SplitScene split;
  if (options.split_views > 0) {
    split = split_scene(scene, options.split_views, CameraRegistry::with_builtin_models());
  } else {
    split.parts.resize(scene.views.size());
    split.scene = std::move(scene);
  }
  if (options.format == ExportFormat::kColmap) {
    write_colmap(options.out / "sparse" / fmt::to_string(number),
                 split.scene,
                 options.is_text ? ColmapForm::kText : ColmapForm::kBinary);
  } else {
    write_nerfstudio(options.out, split.scene, number);
  }
  if (stored.images.empty()) return;
  write_split_images(options.out / "images", options.out / "masks", split, stored.images);
}

/// The markers of a sub-map as markers.yaml, as if they had been surveyed there.
void write_markers(const std::filesystem::path& path, const Map& map, SubmapId submap) {
  KnownMarkers markers;
  for (const MapMarker& marker : map.markers()) {
    if (map.submap_of(marker) != submap) continue;
    markers.by_id[marker.id] = {marker.side_m, map.world_from_marker(marker)};
  }
  write_file_atomically(path, format_known_markers(markers));
}

/// The number-th largest sub-map.
void export_submap(const ExportOptions& options,
                   const StoredMap& stored,
                   SubmapId submap,
                   std::size_t number) {
  const std::filesystem::path file = numbered(options.out, number);
  switch (options.format) {
    case ExportFormat::kTum:
      return write_trajectory(
          file, keyframe_trajectory(*stored.map, submap), TrajectoryFormat::kTum);
    case ExportFormat::kKitti:
      return write_trajectory(
          file, keyframe_trajectory(*stored.map, submap), TrajectoryFormat::kKitti);
    case ExportFormat::kMarkers:
      return write_markers(file, *stored.map, submap);
    case ExportFormat::kPly:
      return write_ply(file, make_export_scene(*stored.map, submap, stored.images));
    case ExportFormat::kColmap:
    case ExportFormat::kNerfstudio:
      return export_model(
          options, stored, make_export_scene(*stored.map, submap, stored.images), number);
  }
}

void export_submaps(const ExportOptions& options,
                    const StoredMap& stored,
                    const std::vector<SubmapId>& submaps) {
  for (std::size_t i = 0; i < submaps.size(); ++i) export_submap(options, stored, submaps[i], i);
}

int export_map(const ExportOptions& options) {
  const StoredMap stored = load_map(options.map);
  const std::vector<SubmapId> submaps = submaps_by_size(*stored.map);
  if (options.format == ExportFormat::kMarkers && stored.map->markers().empty()) {
    throw InputError(options.map.string(),
                     "knows no markers, expected some (run --set markers.family=...)");
  }
  if (submaps.empty()) {
    throw InputError(options.map.string(), "has no keyframes, expected some to export");
  }
  if (makes_folder(options.format)) {
    ExportFolder folder(options.out);
    ExportOptions unfinished = options;
    unfinished.out = folder.unfinished();
    export_submaps(unfinished, stored, submaps);
    folder.finish();
  } else {
    export_submaps(options, stored, submaps);
  }
  print_result("{} sub-map{} of {} to {}\n",
               submaps.size(),
               submaps.size() == 1 ? "" : "s",
               options.map.string(),
               options.out.string());
  if (stored.images.empty() && options.format != ExportFormat::kTum &&
      options.format != ExportFormat::kKitti && options.format != ExportFormat::kMarkers) {
    print_message("note: the map holds no images (run --keep-images); points are grey\n");
  }
  return kDone;
}

}  // namespace

void add_export_command(CLI::App& program, Command& command) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App& exporting = *program.add_subcommand("export", "Write a saved map for other tools");
  exporting.add_option("MAP", options->map, "Map file (.wmap)")->required();
  exporting
      .add_option("-o,--out",
                  options->out,
                  "File for ply, tum, kitti (of keyframes), markers; folder for colmap, nerfstudio")
      ->required();
  add_choice<ExportFormat>(exporting,
                           "--format",
                           options->format,
                           {{"ply", ExportFormat::kPly},
                            {"colmap", ExportFormat::kColmap},
                            {"nerfstudio", ExportFormat::kNerfstudio},
                            {"tum", ExportFormat::kTum},
                            {"kitti", ExportFormat::kKitti},
                            {"markers", ExportFormat::kMarkers}},
                           "ply, colmap, nerfstudio, tum, kitti or markers [ply]");
  exporting.add_flag("--text", options->is_text, "COLMAP's text form instead of its binary one");
  exporting
      .add_option("--split-views",
                  options->split_views,
                  "Split 360 degree and fisheye keyframes into so many perspective views of 90 "
                  "degrees; 6 of 360 degrees are a cube")
      ->check(CLI::Range(kMinSplitViews, kMaxSplitViews));
  exporting.callback([options, &command] { command = [options] { return export_map(*options); }; });
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "choice_option.h"
#include "commands.h"
#include "waymark/base/check.h"
#include "waymark/io/atomic_file.h"
#include "waymark/io/export_colmap.h"
#include "waymark/io/export_nerfstudio.h"
#include "waymark/io/export_ply.h"
#include "waymark/io/export_scene.h"
#include "waymark/io/map_file.h"

namespace waymark {
namespace {

enum class ExportFormat { kPly, kColmap, kNerfstudio, kTum, kKitti };

struct ExportOptions {
  std::filesystem::path map;
  std::filesystem::path out;
  ExportFormat format = ExportFormat::kPly;
  bool is_text = false;
};

/// "points.ply", "points_1.ply" and so on.
std::filesystem::path numbered(std::filesystem::path path, std::size_t number) {
  if (number == 0) return path;
  return path.replace_filename(
      fmt::format("{}_{}{}", path.stem().string(), number, path.extension().string()));
}

/// The number-th largest sub-map.
void export_submap(const ExportOptions& options,
                   const StoredMap& stored,
                   SubmapId submap,
                   std::size_t number) {
  if (options.format == ExportFormat::kTum || options.format == ExportFormat::kKitti) {
    const auto format =
        options.format == ExportFormat::kTum ? TrajectoryFormat::kTum : TrajectoryFormat::kKitti;
    write_trajectory(
        numbered(options.out, number), keyframe_trajectory(*stored.map, submap), format);
    return;
  }
  const ExportScene scene = make_export_scene(*stored.map, submap, stored.images);
  if (options.format == ExportFormat::kPly) {
    write_ply(numbered(options.out, number), scene);
    return;
  }
  if (options.format == ExportFormat::kColmap) {
    write_colmap(options.out / "sparse" / fmt::to_string(number),
                 scene,
                 options.is_text ? ColmapForm::kText : ColmapForm::kBinary);
  } else {
    const std::filesystem::path points = numbered("points.ply", number);
    const std::string json = format_nerfstudio(scene, "images", points.string());
    make_output_folder(options.out);
    write_ply(options.out / points, scene);
    write_file_atomically(options.out / numbered("transforms.json", number), json);
  }
  if (!stored.images.empty()) write_view_images(options.out / "images", scene, stored.images);
}

int export_map(const ExportOptions& options) {
  const StoredMap stored = load_map(options.map);
  const std::vector<SubmapId> submaps = submaps_by_size(*stored.map);
  if (submaps.empty()) {
    throw InputError(options.map.string(), "has no keyframes, expected some to export");
  }
  for (std::size_t i = 0; i < submaps.size(); ++i) export_submap(options, stored, submaps[i], i);
  fmt::print("{} sub-map{} of {} to {}\n",
             submaps.size(),
             submaps.size() == 1 ? "" : "s",
             options.map.string(),
             options.out.string());
  if (stored.images.empty() && options.format != ExportFormat::kTum &&
      options.format != ExportFormat::kKitti) {
    fmt::print(stderr, "note: the map holds no images (run --keep-images); points are grey\n");
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
                  "File for ply, tum, kitti (of keyframes); folder for colmap, nerfstudio")
      ->required();
  add_choice<ExportFormat>(exporting,
                           "--format",
                           options->format,
                           {{"ply", ExportFormat::kPly},
                            {"colmap", ExportFormat::kColmap},
                            {"nerfstudio", ExportFormat::kNerfstudio},
                            {"tum", ExportFormat::kTum},
                            {"kitti", ExportFormat::kKitti}},
                           "ply, colmap, nerfstudio, tum or kitti [ply]");
  exporting.add_flag("--text", options->is_text, "COLMAP's text form instead of its binary one");
  exporting.callback([options, &command] { command = [options] { return export_map(*options); }; });
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "commands.h"
#include "numbers.h"
#include "paths.h"
#include "terminal.h"
#include "waymark/atlas/export_atlas.h"
#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/exchange/export_map.h"
#include "waymark/exchange/export_split.h"
#include "waymark/input/decode.h"
#include "waymark/mapfile/map_file.h"

namespace waymark {
namespace {

struct ExportOptions {
  std::filesystem::path map;
  MapExport what;
  std::vector<std::string> frames = {"keyframes"};
  std::vector<std::filesystem::path> input;
  std::filesystem::path trajectory;
};

[[noreturn]] void fail_frames(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  throw InputError("--frames",
                   "is " + quote_for_message(text) +
                       ", expected keyframes, all, every N or sharpest N with N from 1 on");
}

ExportedFrames parse_frames(const std::vector<std::string>& words) {
  constexpr double kMaxNumber = 1e9;
  static const std::map<std::string, FrameChoice> kChoices = {
      {"keyframes", FrameChoice::kKeyframes},
      {"all", FrameChoice::kAll},
      {"every", FrameChoice::kEvery},
      {"sharpest", FrameChoice::kSharpest}};
  const auto found = kChoices.find(words.front());
  if (found == kChoices.end()) fail_frames(words);
  ExportedFrames frames{found->second, 1};
  const bool has_number =
      frames.choice == FrameChoice::kEvery || frames.choice == FrameChoice::kSharpest;
  if (words.size() != (has_number ? 2u : 1u)) fail_frames(words);
  if (!has_number) return frames;
  const std::optional<double> number = parse_number(words.back());
  if (!number || *number < 1.0 || *number > kMaxNumber) fail_frames(words);
  frames.number = static_cast<std::size_t>(*number);
  if (static_cast<double>(frames.number) != *number) fail_frames(words);
  return frames;
}

int run_export(ExportOptions options) {
  silence_image_library();
  MapExport& what = options.what;
  what.frames = parse_frames(options.frames);
  if (!options.input.empty()) what.input = options.input.front();
  if (options.input.size() > 1) what.reading.right = options.input.back();
  if (!options.trajectory.empty()) {
    what.trajectory = read_trajectory(options.trajectory);
    what.trajectory_name = options.trajectory.string();
  }
  const StoredMap stored = load_map_or_atlas(options.map);
  const MapExportCounts counts = export_map(stored, options.map.string(), what);
  const std::string models =
      counts.num_views == 0
          ? ""
          : ": " + count_of(counts.num_views, "view") + ", " + count_of(counts.num_images, "image");
  print_result("{} of {} to {}{}\n",
               count_of(counts.num_submaps, "sub-map"),
               options.map.string(),
               what.out.string(),
               models);
  if (counts.is_again) print_message("{}: the earlier one was replaced\n", what.out.string());
  const bool has_colors = what.format != ExportFormat::kTum &&
                          what.format != ExportFormat::kKitti &&
                          what.format != ExportFormat::kMarkers;
  if (stored.images.empty() && what.input.empty() && has_colors) {
    print_message("note: the map holds no images (run --keep-images); points are grey\n");
  }
  return kDone;
}

void add_frame_options(CLI::App& exporting, ExportOptions& options) {
  exporting
      .add_option(
          "--frames",
          options.frames,
          "Frames that become views of a model: keyframes, all, every N, or sharpest N, the "
          "sharpest of each of N parts of the way [keyframes]")
      ->expected(1, 2)
      ->type_name("WHICH [N]");
  reads(exporting.add_option(
            "--input",
            options.input,
            "The recording that the map was made of, for images the map does not hold: of "
            "other frames than keyframes, and of camera 1 [none]"))
      ->expected(1, 2)
      ->type_name("INPUT [RIGHT]");
  reads(exporting.add_option("--trajectory",
                             options.trajectory,
                             "Poses of camera 0 in the run that made the map, for --frames (its "
                             "trajectory.txt) [none]"));
}

}  // namespace

void add_export_command(CLI::App& program, Command& command) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App& exporting = *program.add_subcommand("export", "Write a saved map for other tools");
  reads(exporting.add_option("MAP", options->map, "Map file (.wmap), or folder of an atlas"))
      ->required();
  writes(exporting.add_option(
             "-o,--out",
             options->what.out,
             "File for ply, tum, kitti (of keyframes), markers; folder for colmap, nerfstudio"))
      ->required();
  add_choice<ExportFormat>(exporting,
                           "--format",
                           options->what.format,
                           {{"ply", ExportFormat::kPly},
                            {"colmap", ExportFormat::kColmap},
                            {"nerfstudio", ExportFormat::kNerfstudio},
                            {"tum", ExportFormat::kTum},
                            {"kitti", ExportFormat::kKitti},
                            {"markers", ExportFormat::kMarkers}},
                           "ply, colmap, nerfstudio, tum, kitti or markers [ply]");
  exporting.add_flag(
      "--text", options->what.is_text, "COLMAP's text form instead of its binary one");
  exporting
      .add_option("--split-views",
                  options->what.split_views,
                  "Split 360 degree and fisheye keyframes into so many perspective views of 90 "
                  "degrees; 6 of 360 degrees are a cube")
      ->check(CLI::Range(kMinSplitViews, kMaxSplitViews));
  exporting.add_flag(
      "--undistort",
      options->what.is_undistorted,
      "Images and cameras without distortion, for programs that know none (PINHOLE)");
  add_frame_options(exporting, *options);
  exporting.callback([options, &command] { command = [options] { return run_export(*options); }; });
}

}  // namespace waymark

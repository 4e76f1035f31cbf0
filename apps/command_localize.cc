// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "commands.h"
#include "input_command.h"
#include "paths.h"
#include "terminal.h"
#include "waymark/atlas/atlas_localizer.h"
#include "waymark/base/atomic_file.h"
#include "waymark/base/text.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/report/advice.h"
#include "waymark/session/localize_atlas.h"
#include "waymark/session/session.h"

namespace waymark {
namespace {

bool is_single_image(const std::filesystem::path& path) {
  std::error_code error;
  return is_image_name(path) && std::filesystem::is_regular_file(path, error);
}

std::string describe(const Rigid3& world_from_camera) {
  const Eigen::Vector3d& t = world_from_camera.translation;
  const Eigen::Quaterniond& q = world_from_camera.rotation;
  return fmt::format("at {:.4f} {:.4f} {:.4f}, turned {:.6f} {:.6f} {:.6f} {:.6f}",
                     t.x(),
                     t.y(),
                     t.z(),
                     q.x(),
                     q.y(),
                     q.z(),
                     q.w());
}

struct LocalizeOptions {
  std::filesystem::path map;
  std::vector<std::filesystem::path> further;  ///< Inputs: single images, or that of camera 1.
  SessionOptions session;
  CalibrateOptions calibrate;
  ReportOptions report;
  bool is_unordered = false;
};

void report_results(Reporter& reporter,
                    const SessionResults& results,
                    const LocalizeOptions& options) {
  const RunSummary& summary = results.summary;
  reporter.info(fmt::format("{} of {} localized ({} unreadable)",
                            *summary.localized,
                            count_of(summary.counts.frames, "image"),
                            summary.counts.unreadable));
  report_reasons(reporter, results.table, summary);
  for (const std::string& mistake : summary.mistakes.value_or(std::vector<std::string>())) {
    reporter.warning(mistake);
  }
  reporter.info(fmt::format("{}: {:.1f} ms per image; results in {}",
                            format_duration(summary.wall_s),
                            summary.tracking_ms.mean,
                            options.report.out.string()));
  report_advice(reporter, summary);
}

/// Finds all images. Once the calibration turns out to be another, those of a file are found from
/// the start with what it is.
SessionResults localize_all(const LocalizeOptions& options,
                            const std::shared_ptr<const Map>& map,
                            PreparedInput& prepared,
                            Reporter& reporter) {
  const ImageOrder order = options.is_unordered ? ImageOrder::kUnordered : ImageOrder::kStream;
  const auto localize_with = [&](Localizer& localizer) {
    MapDepthCheck check(map, localizer.rig());
    SessionResults results = localize_input(*prepared.input,
                                            localizer,
                                            order,
                                            is_interrupted,
                                            report_frames(reporter, prepared.input->info()),
                                            &check);
    reporter.finish_progress();
    if (const auto mistake = check.advise(prepared.settings.depth.factor)) {
      results.summary.mistakes.emplace().push_back("calibration: " + *mistake);
    }
    return results;
  };
  Localizer localizer(prepared.rig, prepared.settings, map);
  SessionResults results = localize_with(localizer);
  std::vector<CalibrationEstimate> refined = localizer.calibration();
  if (refined.empty()) return results;
  prepared.rig = localizer.rig();
  const bool is_done = prepared.input->info().is_live || is_interrupted() || results.failure;
  if (!is_done) {
    reporter.info("the calibration is another than stated: once more with what the images tell");
    prepared.input.reset();
    prepared.input = open_input(options.session.input, prepared.reading);
    prepared.settings.calibration.refine = "off";
    Localizer again(prepared.rig, prepared.settings, map);
    results = localize_with(again);
  }
  results.summary.refined_calibration = std::move(refined);
  return results;
}

/// In an atlas the calibration is taken as it is stated.
SessionResults localize_tiles(const LocalizeOptions& options,
                              const Atlas& atlas,
                              PreparedInput& prepared,
                              Reporter& reporter) {
  AtlasLocalizer localizer(prepared.rig, prepared.settings, atlas);
  const ImageOrder order = options.is_unordered ? ImageOrder::kUnordered : ImageOrder::kStream;
  SessionResults results = localize_in_atlas(*prepared.input,
                                             localizer,
                                             order,
                                             is_interrupted,
                                             report_frames(reporter, prepared.input->info()));
  reporter.finish_progress();
  reporter.info(fmt::format("{} of {} opened, {}",
                            localizer.num_tiles_seen(),
                            count_of(atlas.contents().tiles.size(), "tile"),
                            count_of(localizer.num_opened(), "time")));
  return results;
}

void write_outputs(const LocalizeOptions& options,
                   PreparedInput& prepared,
                   SessionResults& results,
                   Reporter& reporter) {
  if (is_interrupted()) reporter.info("interrupted: the input ends here");
  results.summary.timing = to_string(Timing::kInline);
  results.summary.seed = static_cast<std::uint64_t>(prepared.settings.seed);
  results.summary.version = WAYMARK_VERSION;
  add_input(prepared, results.summary);
  results.summary.advice = advise(results.table, results.summary);
  save_each(
      {[&] { write_results(options.report.out, results); },
       [&] { write_calibration(options.report.out, prepared, prepared.rig, results.summary); },
       [&] {
         report_results(reporter, results, options);
         report_calibration(reporter, results.summary);
         check_finished(results);
       }});
}

/// A map, or an atlas.
struct SearchedMap {
  std::optional<Atlas> atlas;
  std::shared_ptr<const Map> map;
  std::string description;

  explicit SearchedMap(const std::filesystem::path& path) {
    if (is_atlas(path)) {
      atlas = Atlas::open(path);
      description = fmt::format("{}: {} of {}",
                                path.string(),
                                count_of(atlas->contents().tiles.size(), "tile"),
                                count_of(atlas->contents().recordings.size(), "recording"));
    } else {
      map = load_map(path).map;
      description = describe(*map, path);
    }
  }

  /// Camera 0 of each recording.
  std::vector<CameraChain> cameras() const {
    std::vector<CameraChain> found;
    const auto add = [&found](const Map& searched) {
      searched.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
        Rig rig = keyframe.rig();
        rig.cameras.resize(1);
        const auto is_same = [&](const CameraChain& other) {
          return other.cameras[0].description.is_same(*rig.cameras[0].description);
        };
        if (!rig.cameras[0].description || std::ranges::any_of(found, is_same)) return;
        found.push_back(*chain_of(rig, {}));
      });
    };
    if (map) add(*map);
    for (std::uint32_t i = 0; atlas && i < atlas->contents().recordings.size(); ++i) {
      const std::vector<AtlasTile>& tiles = atlas->contents().tiles;
      const auto tile = std::ranges::find(tiles, i, &AtlasTile::recording);
      if (tile != tiles.end()) add(*atlas->load_tile(*tile).map);
    }
    return found;
  }

  bool has_scale() const {
    return atlas ? std::ranges::all_of(atlas->contents().tiles, &AtlasTile::is_metric)
                 : is_metric(*map);
  }
};

/// Single images are each by itself, and have no calibration but that of the map.
void take_further_inputs(LocalizeOptions& options) {
  InputOptions& reading = options.session.reading;
  std::vector<std::filesystem::path> images = {options.session.input};
  images.insert(images.end(), options.further.begin(), options.further.end());
  if (std::ranges::all_of(images, is_single_image)) {
    options.is_unordered = true;
    reading.images = std::move(images);
  } else if (!options.further.empty()) {
    if (options.further.size() > 1) {
      throw InputError("command line", "has several inputs, expected one, a pair, or image files");
    }
    reading.right = options.further.front();
  }
  reading.has_names = options.is_unordered;
}

/// A line of each single image on standard output.
void print_poses(const SessionResults& results) {
  std::map<std::int64_t, const StampedPose*> poses;
  for (const auto& trajectory : results.trajectories) {
    for (const StampedPose& pose : trajectory) poses[pose.timestamp_ns] = &pose;
  }
  for (std::size_t i = 0; i < results.table.names.size(); ++i) {
    const FrameRecord& frame = results.table.frames[i];
    const auto found = poses.find(frame.timestamp_ns);
    print_result("{}: {}\n",
                 results.table.names[i],
                 found == poses.end() ? fmt::format("not found, {}", to_string(frame.reason))
                                      : describe(found->second->world_from_camera));
  }
}

int localize(LocalizeOptions options, Reporter& reporter) {
  take_further_inputs(options);
  const SearchedMap searched(options.map);
  options.session.calibrate = reported(options.calibrate, reporter);
  if (options.is_unordered) options.session.known_cameras = searched.cameras();
  PreparedInput prepared = prepare_input(options.session);
  for (const std::string& line : prepared.description) reporter.info(line);
  warn_unless_sure(reporter, prepared, "the map may tell");
  reporter.info(searched.description);
  const bool has_range = prepared.input->info().setup != Setup::kMono;
  if (has_range && !searched.has_scale()) {
    reporter.info("the map has no scale in metres: only camera 0 is used, without depth");
  }
  if (prepare_results(options.report.out)) report_replacement(reporter, options.report);
  SessionResults results = searched.atlas
                               ? localize_tiles(options, *searched.atlas, prepared, reporter)
                               : localize_all(options, searched.map, prepared, reporter);
  if (!options.session.reading.images.empty()) print_poses(results);
  write_outputs(options, prepared, results, reporter);
  return *results.summary.localized == 0 ? kNoPose : kDone;
}

}  // namespace

void add_localize_command(CLI::App& program, Command& command) {
  const auto options = std::make_shared<LocalizeOptions>();
  CLI::App& localize_command = *program.add_subcommand(
      "localize", "Find images in a saved map or an atlas, which stays as it is");
  reads(localize_command.add_option("MAP", options->map, "Map file (.wmap), or folder of an atlas"))
      ->required();
  add_input_options(localize_command, options->session);
  localize_command.remove_option(localize_command.get_option("RIGHT"));
  reads(localize_command.add_option(
      "IMAGE",
      options->further,
      "Where INPUT is an image file, more of them; else as RIGHT of run"));
  add_selection_options(localize_command, options->session.reading);
  add_fov_option(localize_command, options->calibrate);
  localize_command.option_defaults()->group("How it runs");
  localize_command.add_flag(
      "--unordered", options->is_unordered, "Each image by itself, rather than a stream [off]");
  add_report_options(localize_command, options->report, options->session.seed);
  localize_command.footer(
      "Examples:\n"
      "  waymark localize walk.wmap again.mp4 -c camchain.yaml\n"
      "  waymark localize walk.wmap photo.jpg other.jpg\n"
      "  waymark localize city photos -c camchain.yaml --unordered");
  localize_command.callback([options, &command] {
    command = [options] {
      return run_and_log(options->report,
                         [&](Reporter& reporter) { return localize(*options, reporter); });
    };
  });
}

}  // namespace waymark

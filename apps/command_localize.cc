// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "commands.h"
#include "input_command.h"
#include "waymark/atlas/atlas_localizer.h"
#include "waymark/base/atomic_file.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/report/advice.h"
#include "waymark/session/localize_atlas.h"
#include "waymark/session/session.h"

namespace waymark {
namespace {

struct LocalizeOptions {
  std::filesystem::path map;
  SessionOptions session;
  CalibrateOptions calibrate;
  ReportOptions report;
  bool is_unordered = false;
};

void report_results(Reporter& reporter,
                    const SessionResults& results,
                    const LocalizeOptions& options) {
  const RunSummary& summary = results.summary;
  reporter.info(fmt::format("{} of {} images localized ({} unreadable)",
                            *summary.localized,
                            summary.counts.frames,
                            summary.counts.unreadable));
  report_reasons(reporter, results.table, summary);
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
    SessionResults results = localize_input(*prepared.input,
                                            localizer,
                                            order,
                                            is_interrupted,
                                            report_frames(reporter, prepared.input->info()));
    reporter.finish_progress();
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
  reporter.info(fmt::format("{} of {} tiles opened, {} times",
                            localizer.num_tiles_seen(),
                            atlas.contents().tiles.size(),
                            localizer.num_opened()));
  return results;
}

void write_all(const LocalizeOptions& options,
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
      description = fmt::format("{}: {} tiles of {} recordings",
                                path.string(),
                                atlas->contents().tiles.size(),
                                atlas->contents().recordings.size());
    } else {
      map = load_map(path).map;
      description = describe(*map, path);
    }
  }

  bool has_scale() const {
    return atlas ? std::ranges::all_of(atlas->contents().tiles, &AtlasTile::is_metric)
                 : is_metric(*map);
  }
};

int localize(LocalizeOptions options, Reporter& reporter) {
  const SearchedMap searched(options.map);
  options.session.calibrate = reported(options.calibrate, reporter);
  PreparedInput prepared = prepare_input(options.session);
  for (const std::string& line : prepared.description) reporter.info(line);
  warn_unless_sure(reporter, prepared, "the map may tell");
  reporter.info(searched.description);
  const bool has_range = prepared.input->info().setup != Setup::kMono;
  if (has_range && !searched.has_scale()) {
    reporter.info("the map has no scale in metres: only camera 0 is used, without depth");
  }
  prepare_results(options.report.out);
  SessionResults results = searched.atlas
                               ? localize_tiles(options, *searched.atlas, prepared, reporter)
                               : localize_all(options, searched.map, prepared, reporter);
  write_all(options, prepared, results, reporter);
  return *results.summary.localized == 0 ? kNoPose : kDone;
}

}  // namespace

void add_localize_command(CLI::App& program, Command& command) {
  const auto options = std::make_shared<LocalizeOptions>();
  CLI::App& localize_command = *program.add_subcommand(
      "localize", "Find the images of INPUT in a saved map or an atlas, which stays as it is");
  localize_command.add_option("MAP", options->map, "Map file (.wmap), or folder of an atlas")
      ->required();
  add_input_options(localize_command, options->session);
  add_selection_options(localize_command, options->session.reading);
  add_fov_option(localize_command, options->calibrate);
  localize_command.add_flag(
      "--unordered", options->is_unordered, "Each image by itself, rather than a stream [off]");
  add_report_options(localize_command, options->report, options->session.seed);
  localize_command.callback([options, &command] {
    command = [options] {
      return run_and_log(options->report,
                         [&](Reporter& reporter) { return localize(*options, reporter); });
    };
  });
}

}  // namespace waymark

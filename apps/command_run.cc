// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <atomic>
#include <exception>
#include <memory>
#include <optional>
#include <string>

#include "commands.h"
#include "input_command.h"
#include "live_control.h"
#include "numbers.h"
#include "paths.h"
#include "reporter.h"
#include "run_messages.h"
#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/base/disk_memory.h"
#include "waymark/report/advice.h"
#include "waymark/report/report.h"
#include "waymark/session/autosave.h"
#include "waymark/session/calibration_advice.h"
#include "waymark/session/keyframe_image_cache.h"
#include "waymark/session/live_input.h"
#include "waymark/session/overlay_video.h"
#include "waymark/session/quality.h"
#include "waymark/session/second_pass.h"
#include "waymark/session/session.h"
#include "waymark/session/session_options.h"

namespace waymark {
namespace {

struct RunOptions {
  SessionOptions session;
  CalibrateOptions calibrate;
  ReportOptions report;
  std::filesystem::path map_out;  ///< Empty: the map is not saved.
  double autosave_s = 60.0;
  double pace = 0.0;                    ///< Times the input's own rate; 0: as fast as possible.
  std::optional<Timing> timing;         ///< Nothing: what suits the input.
  std::string viewer;                   ///< [HOST:]PORT; empty: off.
  std::filesystem::path overlay;        ///< Video to make; empty: none.
  std::optional<double> max_memory_gb;  ///< Nothing: no limit.
  bool has_imu_rate = false;            ///< Whether trajectory.txt has a pose per sample.
  bool has_report = false;              ///< Whether a page on it is among the results.
};

/// Tells the user, the autosave and the viewer (null: none) of each frame.
FrameObserver observe(Session& session, Autosave& autosave, LiveControl* live, Reporter& reporter) {
  return [&, live, report = report_frames(reporter, session.input->info())](
             const FrameRecord& record, const std::string& warning) mutable {
    report(record, warning);
    if (live) live->show(record);
    if (const auto failure = autosave.update(session.system->map(), session.system->inertial())) {
      reporter.warning("autosave: " + *failure);
    }
  };
}

/// Features drawn into the images, where that is asked for.
std::optional<OverlayVideo> start_overlay(const std::filesystem::path& path) {
  if (path.empty()) return std::nullopt;
  return std::optional<OverlayVideo>(std::in_place, path);
}

SessionResults map_input(Session& session,
                         Input& input,
                         SessionHooks hooks,
                         Autosave& autosave,
                         LiveControl* live,
                         OverlayVideo* overlay,
                         Reporter& reporter) {
  CalibrationMonitor watch(session,
                           [&reporter](const std::string& mistake) { reporter.warning(mistake); });
  watch.compare_with(session.system->map());
  hooks.watch = &watch;
  hooks.should_stop = is_interrupted;
  hooks.observer = observe(session, autosave, live, reporter);
  if (live) {
    hooks.should_stop = [live] { return live->should_stop(is_interrupted); };
    hooks.on_input_end = [live] { live->finishing(); };
  }
  hooks.on_result = [&, live, overlay](const FrameImages& frame, const TrackingResult& result) {
    if (live) live->show(frame, result);
    if (overlay) overlay->add(frame, result);
  };
  SessionResults results = run_session(input, *session.system, hooks);
  try {
    if (overlay) overlay->finish();
  } catch (const OutputError&) {  // Told once the rest is saved.
    if (!results.failure) results.failure = std::current_exception();
  }
  if (overlay && !overlay->is_h264()) {
    reporter.warning("--overlay: OpenCV has no encoder for H.264, browsers may not play the video");
  }
  return results;
}

void save_final_map(const System& system,
                    const RunOptions& options,
                    Autosave& autosave,
                    Reporter& reporter) {
  if (system.map()->keyframes().is_empty()) {
    reporter.warning(fmt::format("{}: there is no map to save, the file stays as it was",
                                 options.map_out.string()));
    return;
  }
  autosave.save(system.map(), system.inertial());
  reporter.info(fmt::format("map in {}", options.map_out.string()));
}

/// Before the input is opened and its calibration found, which may take long.
void start_viewer(const RunOptions& options, Reporter& reporter, std::optional<LiveControl>& live) {
  SessionInfo info;
  info.program = std::string("waymark ") + WAYMARK_VERSION;
  info.input = options.session.input.filename().string();
  info.timing = to_string(options.session.timing);
  info.can_save = !options.map_out.empty();
  info.keeps_images = options.session.reading.has_jpeg;
  live.emplace(parse_viewer_address(options.viewer, "--viewer"), std::move(info), reporter);
  reporter.info(fmt::format("viewer: open {} in a browser", live->url()));
}

/// The first pass over the input, which is saved, where there is a second.
struct FirstPass {
  SecondPass found;
  SessionResults results;
};

/// Whether frames of the input were left out.
bool has_ended_early(const SessionResults& results, const LiveControl* live) {
  return is_interrupted() || results.failure || (live && live->is_stopped());
}

/// The calibration with which the input is to be mapped once more, if it is.
std::optional<SecondPass> begin_again(const Session& session, const RunOptions& options) {
  const bool is_paced = options.pace > 0.0 || options.session.timing == Timing::kRealtime;
  // A map to go on in is another one by now where it is saved to the same file.
  if (is_paced || !options.session.map_in.empty()) return std::nullopt;
  return calibration_for_second_pass(session);
}

/// Adds what an earlier pass told and took.
void add_first(const RunSummary& first, RunSummary& summary) {
  summary.refined_calibration =
      join_passes(first.refined_calibration, std::move(summary.refined_calibration));
  summary.mistakes = first.mistakes;  // Of the calibration as stated.
  summary.wall_s += first.wall_s;
  summary.cpu_s += first.cpu_s;
}

/// report: told last, together with what could not be saved.
void save_results(const RunOptions& options,
                  const Session& session,
                  const SessionResults& results,
                  Autosave& autosave,
                  const std::function<void()>& report,
                  Reporter& reporter) {
  const std::filesystem::path& out = options.report.out;
  save_each({[&] { write_results(out, results); },
             [&] {
               if (options.has_report) return write_report(out);
               std::filesystem::remove(out / "report.html");  // Of an earlier run.
             },
             [&] { write_calibration(out, session, *session.system->rig(), results.summary); },
             [&] {
               if (options.map_out.empty()) return;
               save_final_map(*session.system, options, autosave, reporter);
             },
             report});
}

int status_of(const SessionResults& results) {
  return results.summary.counts.tracked == 0 ? kNoPose : kDone;
}

/// Saves and reports; the status of the program, or nothing where the input is to be mapped once
/// more, which `first` tells then.
std::optional<int> finish(const RunOptions& options,
                          const Session& session,
                          SessionResults results,
                          Autosave& autosave,
                          LiveControl* live,
                          std::optional<FirstPass>& first,
                          Reporter& reporter) {
  const auto report = [&](const SessionResults& told) {
    if (live) live->finish();
    report_results(reporter, told, options.report.out);
    report_calibration(reporter, told.summary);
    check_finished(told);  // What ended the session early is told with what could not be saved.
  };
  const bool has_ended = has_ended_early(results, live);
  if (first && has_ended) {
    reporter.info("the results are those of the first time");
    report(first->results);
    return status_of(first->results);
  }
  const auto again = first || has_ended ? std::nullopt : begin_again(session, options);
  if (first) add_first(first->results.summary, results.summary);
  if (again && !again->mistake.empty()) {
    reporter.warning(again->mistake);
    if (!results.summary.mistakes) results.summary.mistakes.emplace();
    results.summary.mistakes->push_back(again->mistake);
  }
  if (options.has_imu_rate && results.at_imu_rate.empty()) {
    reporter.warning("--rate imu: no IMU told the way in metres, poses are those of images");
  }
  results.summary.advice = advise(results.table, results.summary);
  const auto last = [&] {
    if (!again) report(results);
  };
  save_results(options, session, results, autosave, last, reporter);
  if (!again) return status_of(results);
  first = FirstPass{*again, std::move(results)};
  return std::nullopt;
}

/// Maps the input; see finish().
std::optional<int> map_once(const RunOptions& options,
                            LiveControl* live,
                            std::optional<FirstPass>& first,
                            Reporter& reporter) {
  Session session = open_session(options.session);
  if (!first) {
    for (const std::string& line : session.description) reporter.info(line);
  }
  warn_unless_sure(reporter, session, "expect a bent map");
  if (prepare_results(options.report.out) && !first) report_replacement(reporter, options.report);
  if (options.max_memory_gb) {
    session.system->keep_map_in(std::make_shared<DiskMemory>(
        options.report.out, static_cast<std::size_t>(*options.max_memory_gb * 1e9)));
  }
  const bool has_map_out = !options.map_out.empty();
  if (has_map_out) {
    AtomicFile{options.map_out};  // Fails now rather than in the end.
    remove_abandoned_parts(options.map_out);
  }
  std::atomic<bool> is_paused{false};
  TimedInput input(*session.input,
                   options.pace,
                   options.session.timing == Timing::kRealtime,
                   is_interrupted,
                   [&is_paused] { return is_paused.load(std::memory_order_relaxed); });
  KeyframeImageCache images([&] { return session.system->map(); }, std::move(session.images));
  SessionHooks hooks;
  hooks.is_paced = options.pace > 0.0;
  hooks.wants_imu_rate = options.has_imu_rate;
  hooks.on_decoded = [&images](InputFrame& frame) { images.add(frame); };
  Autosave autosave(options.map_out,
                    has_map_out && !first ? options.autosave_s : 0.0,  // There is a whole map.
                    settings_as_yaml(session.settings),
                    images);

  if (live) live->begin({*session.system, autosave, images, is_paused}, session.input->info());
  std::optional<OverlayVideo> overlay = start_overlay(options.overlay);
  OverlayVideo* const drawn = overlay ? &*overlay : nullptr;
  SessionResults results =
      map_input(session, input.get(), std::move(hooks), autosave, live, drawn, reporter);
  reporter.finish_progress();
  if (is_interrupted()) reporter.info("interrupted: the input ends here");
  results.summary.timing = to_string(options.session.timing);
  results.summary.seed = static_cast<std::uint64_t>(session.settings.seed);
  results.summary.version = WAYMARK_VERSION;
  results.summary.refined_calibration = session.system->calibration();
  add_input(session, results.summary);
  return finish(options, session, std::move(results), autosave, live, first, reporter);
}

int run(RunOptions options, Reporter& reporter) {
  const Timing suitable = is_camera(options.session.input) ? Timing::kRealtime : Timing::kLockstep;
  options.session.timing = options.timing.value_or(suitable);
  options.session.calibrate = reported(options.calibrate, reporter);
  std::optional<LiveControl> live;
  if (!options.viewer.empty()) {
    start_viewer(options, reporter, live);
    options.session.calibrate = live->shown(*options.session.calibrate);
  }
  LiveControl* const shown = live ? &*live : nullptr;
  std::optional<FirstPass> first;
  if (const auto status = map_once(options, shown, first, reporter)) return *status;
  reporter.info("the calibration is another than stated: once more with what the images tell");
  options.session.calibration = first->found.calibration;
  if (const double offset = first->found.inverse_depth_offset; offset != 0.0) {
    options.session.assignments.push_back(fmt::format("depth.inverse_offset={:.9g}", offset));
  }
  return *map_once(options, shown, first, reporter);
}

void add_pace_option(CLI::App& command, RunOptions& options) {
  command
      .add_option("--pace",
                  options.pace,
                  "Feed files at their own rate times X, as a camera would [off; X is 1]")
      ->expected(0, 1)
      ->default_str("1")
      ->type_name("[X]")
      ->check(number_between(1e-3, 1e3));
}

void add_rate_option(CLI::App& command, RunOptions& options) {
  command
      .add_option_function<std::string>(
          "--rate",
          [&options](const std::string& rate) { options.has_imu_rate = rate == "imu"; },
          "Poses in trajectory.txt: one per image, or with an IMU in use one per sample [image]")
      ->check(CLI::IsMember({"image", "imu"}));
}

void add_map_options(CLI::App& command, RunOptions& options) {
  command.option_defaults()->group("Map");
  reads(command.add_option(
      "--map-in",
      options.session.map_in,
      "Start from a saved map: find the camera in it and extend it [a new map]"));
  CLI::Option& map_out = *writes(command.add_option(
      "--map-out",
      options.map_out,
      "Save the map to this file (.wmap), which may be that of --map-in [not saved]"));
  command
      .add_option("--autosave",
                  options.autosave_s,
                  "Save it every so many seconds while running, too; 0: at the end only [60]")
      ->needs(&map_out)
      ->check(number_between(0.0, 1e6));
  command
      .add_flag("--keep-images",
                options.session.reading.has_jpeg,
                "Keep the images of keyframes in the map, for export and the viewer [off]")
      ->needs(&map_out);
  command
      .add_option("--max-memory",
                  options.max_memory_gb,
                  "From so much memory on, what the map rarely needs lies in a file in --out [off]")
      ->type_name("GB")
      ->check(number_between(0.0, 1e6));
}

}  // namespace

void add_run_command(CLI::App& program, Command& command) {
  const auto options = std::make_shared<RunOptions>();
  CLI::App& run_command = *program.add_subcommand("run", "Map INPUT; write results to --out");
  add_input_options(run_command, options->session);
  add_selection_options(run_command, options->session.reading);
  add_fov_option(run_command, options->calibrate);
  run_command.option_defaults()->group("How it runs");
  add_pace_option(run_command, *options);
  add_rate_option(run_command, *options);
  add_choice<std::optional<Timing>>(
      run_command,
      "--timing",
      options->timing,
      {{"inline", Timing::kInline},
       {"lockstep", Timing::kLockstep},
       {"realtime", Timing::kRealtime}},
      "inline (one thread), lockstep (threads, same results) or realtime (never waits; with --pace "
      "or a camera frames that come too early for it are dropped) [realtime for cameras, else "
      "lockstep]");
  run_command
      .add_option("--viewer",
                  options->viewer,
                  "Show the session in the browser, at this port of this machine [off]")
      ->type_name("[HOST:]PORT");
  add_map_options(run_command, *options);
  run_command.option_defaults()->group("Results and messages");
  writes(run_command.add_option("--overlay",
                                options->overlay,
                                "Video (.mp4) of the images with their features drawn in [none]"));
  run_command.add_flag("--report",
                       options->has_report,
                       "Write a page on the run, report.html, among the results [off]");
  add_report_options(run_command, options->report, options->session.seed);
  run_command.footer(
      "Examples:\n"
      "  waymark run MH_01_easy\n"
      "  waymark run walk.mp4 --map-out walk.wmap --keep-images --report\n"
      "  waymark run left right -c camchain.yaml --viewer 8080\n"
      "  waymark run again.mp4 --map-in walk.wmap --map-out walk.wmap");
  run_command.callback([options, &command] {
    command = [options] {
      return run_and_log(options->report,
                         [&](Reporter& reporter) { return run(*options, reporter); });
    };
  });
}

}  // namespace waymark

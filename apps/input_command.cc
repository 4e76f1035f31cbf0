// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "input_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <exception>
#include <iostream>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "commands.h"
#include "numbers.h"
#include "paths.h"
#include "python_tool.h"
#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/base/failure.h"
#include "waymark/base/frame_state.h"
#include "waymark/base/text.h"
#include "waymark/camera/calibration.h"
#include "waymark/input/decode.h"
#include "waymark/input/imu_camchain.h"
#include "waymark/report/documentation.h"

namespace waymark {
namespace {

/// Whether its depth or its image of camera 1 could not be used: bad files that take no frame away.
bool is_without_partner(const FrameRecord& frame) {
  return frame.state != FrameState::kUnreadable && frame.has_warning;
}

/// All of it; a list of images is no longer than that.
std::string read_standard_input() {
  constexpr std::size_t kMaxBytes = std::size_t{256} << 20;
  std::string text;
  std::array<char, 65536> buffer;
  while (std::cin.read(buffer.data(), buffer.size()), std::cin.gcount() > 0) {
    text.append(buffer.data(), static_cast<std::size_t>(std::cin.gcount()));
    if (text.size() <= kMaxBytes) continue;
    throw InputError("standard input", "is longer than 256 MiB, expected a list of images");
  }
  return text;
}

}  // namespace

void add_input_argument(CLI::App& command, std::filesystem::path& input, InputOptions& reading) {
  reads(command.add_option(
            "INPUT",
            input,
            "Data set folder, folder of images, video file, bag of ROS, camera or address; - "
            "reads a list of images"))
      ->required()
      ->each([&reading](const std::string& path) {
        if (path == "-") reading.image_list = read_standard_input();
      });
}

void add_change_options(CLI::App& command, InputOptions& reading) {
  command
      .add_option("--rotate",
                  reading.rotate_deg,
                  "Turns images clockwise by 90, 180 or 270 degrees, and the calibration with them "
                  "[as they are]")
      ->check(CLI::IsMember({90, 180, 270}))
      ->type_name("DEG");
  command
      .add_option("--resize",
                  reading.resize_px,
                  "Makes images smaller, to this width in pixels, and the calibration with them "
                  "[as they are]")
      ->check(whole_from(16));
}

void add_reading_options(CLI::App& command, std::filesystem::path& input, InputOptions& reading) {
  command.option_defaults()->group("Input");
  add_input_argument(command, input, reading);
  reads(command.add_option(
      "RIGHT", reading.right, "Images or video of camera 1, INPUT being those of camera 0 [none]"));
  command
      .add_option("--format",
                  reading.format,
                  "Kind of INPUT: euroc, kitti, tum, replica, images, video or bag [recognised]")
      ->check(CLI::IsMember({"euroc", "kitti", "tum", "replica", "images", "video", "bag"}));
  command
      .add_option("--topics",
                  reading.topics,
                  "Of a bag: the images of camera 0, and those of camera 1 or the depth [found]")
      ->delimiter(',')
      ->type_name("A[,B]")
      ->allow_extra_args(false);
  add_choice<std::optional<BagTimes>>(
      command,
      "--times",
      reading.times,
      {{"headers", BagTimes::kHeaders}, {"bag", BagTimes::kRecording}},
      "Of a bag: the stamps of its images, headers, or when they were recorded, bag [headers, bag "
      "where their clock was set back]");
  add_choice<std::optional<Split>>(command,
                                   "--split",
                                   reading.split,
                                   {{"side-by-side", Split::kSideBySide},
                                    {"top-bottom", Split::kTopBottom},
                                    {"tracks", Split::kTracks},
                                    {"none", Split::kNone}},
                                   "Two cameras in each picture, side-by-side or top-bottom, or in "
                                   "two tracks of a video, tracks "
                                   "[found, none turns that off]");
  reads(command.add_option("--depth", reading.depth, "Depth images of a folder of images [none]"));
  reads(command.add_option("--imu",
                           reading.imu,
                           "Inertial data: a table, or none, which ignores those of "
                           "INPUT [those that INPUT carries]"))
      ->type_name("FILE|none");
  command
      .add_option("--fps", reading.fps, "Frames per second where nothing tells their times [30]")
      ->check(number_between(0.01, 10000.0));
  add_change_options(command, reading);
  add_choice<std::optional<Setup>>(
      command,
      "--setup",
      reading.setup,
      {{"mono", Setup::kMono}, {"stereo", Setup::kStereo}, {"rgbd", Setup::kRgbd}},
      "mono, stereo or rgbd [all that INPUT offers]");
}

void add_input_options(CLI::App& command, SessionOptions& options) {
  options.read_slam_settings = read_settings_by_tool;
  add_reading_options(command, options.input, options.reading);
  command.option_defaults()->group("Cameras and settings");
  reads(command.add_option(
            "-c,--config",
            options.configs,
            "YAML file with cameras (Kalibr camchain) and settings; may be repeated, later "
            "files override [none]"))
      ->allow_extra_args(false);
  command
      .add_option(
          "--set", options.assignments, "One setting as KEY=VALUE, e.g. features.count=1500 [none]")
      ->allow_extra_args(false);
}

void add_selection_options(CLI::App& command, InputOptions& reading) {
  command.option_defaults()->group("Part of the input");
  command.add_option("--first", reading.first, "Index of the first frame to use [0]")
      ->check(whole_from(0));
  command.add_option("--frames", reading.frames, "Use at most so many frames [all]")
      ->check(whole_from(1));
  command.add_option("--every", reading.every, "Use each N-th frame [1]")->check(whole_from(1));
  reads(command.add_option(
      "--mask",
      reading.mask,
      "Mask image, a folder with one per frame by name or in order, or a video of them; black is "
      "not used [none]"));
}

void add_fov_option(CLI::App& command, CalibrateOptions& options) {
  command.option_defaults()->group("Cameras and settings");
  command
      .add_option("--fov",
                  options.fov_deg,
                  "Horizontal field of view in degrees, roughly, of an INPUT without calibration "
                  "[estimated]")
      ->check(number_between(5.0, 240.0));
}

void report_replacement(Reporter& reporter, const ReportOptions& options) {
  reporter.info(
      fmt::format("{}: the results of an earlier run are replaced", options.out.string()));
}

CalibrateOptions reported(CalibrateOptions options, Reporter& reporter) {
  options.should_stop = is_interrupted;
  options.on_progress = [&reporter](const std::string& text) { reporter.info(text); };
  return options;
}

void warn_unless_sure(Reporter& reporter, const PreparedInput& prepared, std::string_view what) {
  if (!prepared.estimated || prepared.estimated->is_sure) return;
  reporter.warning(fmt::format("calibration: {}; {}", prepared.estimated->reason, what));
}

void add_input(const PreparedInput& prepared, RunSummary& summary) {
  const InputInfo& info = prepared.input->info();
  summary.setup = to_string(info.setup);
  summary.input = prepared.description;
  summary.settings = changed_settings(prepared.settings);
  summary.out_of_order = info.counts.out_of_order;
  summary.without_partner = info.counts.without_partner;
  summary.missing_at_end = info.counts.missing_at_end;
  if (!prepared.estimated) return;
  const EstimatedCalibration& calibration = *prepared.estimated;
  EstimatedCalibrationSummary& told = summary.calibration.emplace();
  told.model = to_string(calibration.model);
  if (!calibration.camera.intrinsics.empty()) {
    told.focal_px = calibration.camera.intrinsics[0];
    told.focal_sigma_px = calibration.sigmas[0] * told.focal_px;
  }
  told.fov_deg = calibration.fov_deg;
  told.is_sure = calibration.is_sure;
}

void report_calibration(Reporter& reporter, const RunSummary& summary) {
  std::string changes;
  for (const CalibrationEstimate& estimate : summary.refined_calibration) {
    if (!estimate.is_changed()) continue;
    changes += fmt::format("{}{} {:.6g} -> {:.6g} +- {:.2g}",
                           changes.empty() ? "calibration changed: " : ", ",
                           estimate.name,
                           estimate.given,
                           estimate.given + estimate.change,
                           estimate.sigma);
  }
  if (!changes.empty()) reporter.info(changes);
}

void write_calibration(const std::filesystem::path& folder,
                       const PreparedInput& prepared,
                       const Rig& rig,
                       const RunSummary& summary) {
  const std::filesystem::path file = folder / "calibration.yaml";
  const bool has_imu = summary.imu && summary.imu->is_used && !prepared.reading.rotate_deg;
  const bool is_news = has_imu || prepared.estimated || !summary.refined_calibration.empty();
  const auto chain = is_news ? chain_of(rig, summary.refined_calibration) : std::nullopt;
  if (!chain) {
    std::filesystem::remove(file);  // Of an earlier run.
    return;
  }
  const ImuCalibration imu = has_imu ? summary.imu->calibration() : ImuCalibration();
  std::string text = format_camchain_imu(prepared.input->of_unchanged_images(*chain), imu);
  if (prepared.input->info().setup == Setup::kRgbd) {
    const DepthSettings& depth = prepared.settings.depth;
    text += fmt::format("depth: {{factor: {:.6g}, lag_ms: {:.6g}, inverse_offset: {:.6g}}}\n",
                        depth.factor,
                        depth.lag_ms,
                        rig.inverse_depth_offset);
  }
  write_file_atomically(file, text);
}

void add_report_options(CLI::App& command, ReportOptions& options, std::optional<int>& seed) {
  command.option_defaults()->group("Results and messages");
  writes_results(command.add_option("-o,--out", options.out, "Folder for the results"))
      ->capture_default_str();
  command.add_option("--seed", seed, "Seed of all random numbers [0]")
      ->check(CLI::Range(0, 1000000000));
  CLI::Option& quiet = *command.add_flag("--quiet", options.is_quiet, "Errors only [off]");
  command.add_flag("--verbose", options.is_verbose, "A line per frame [off]")->excludes(&quiet);
  writes(command.add_option("--log", options.log, "Write all messages to this file, too [none]"));
}

FrameObserver report_frames(Reporter& reporter, const InputInfo& info) {
  const char* partner = info.setup == Setup::kStereo ? "camera 1" : "depth";
  return [&reporter, partner, total = info.num_frames, num_done = std::size_t{0}](
             const FrameRecord& frame, const std::string& warning) mutable {
    const bool has_reason = frame.reason != FrameReason::kNone;
    const std::string state = fmt::format(
        "{}{}{}{}",
        to_string(frame.state),
        frame.submap.is_valid() ? fmt::format(" in sub-map {}", frame.submap.value) : "",
        has_reason ? ": " : "",
        has_reason ? to_string(frame.reason) : "");
    if (frame.state == FrameState::kUnreadable) {
      reporter.warning(fmt::format("frame {}: {}, skipped{}",
                                   frame.index,
                                   state,
                                   warning.empty() ? "" : " (" + warning + ")"));
    } else if (is_without_partner(frame)) {
      reporter.warning(
          fmt::format("frame {}: used without {} ({})", frame.index, partner, warning));
    }
    const int num_candidates = frame.num_candidates;
    reporter.detail(
        fmt::format("frame {}: {}, {} of {}{}",
                    frame.index,
                    state,
                    count_of(frame.num_inliers, "inlier"),
                    count_of(frame.num_matches, "match", "matches"),
                    num_candidates > 0 ? ", best of " + count_of(num_candidates, "place") : ""));
    reporter.progress(++num_done, total, to_string(frame.state));
  };
}

void report_reasons(Reporter& reporter, const FrameTable& table, const RunSummary& summary) {
  if (summary.missing_at_end > 0) {
    reporter.warning(fmt::format("the video ends {} before its container says",
                                 count_of(summary.missing_at_end, "frame")));
  }
  std::map<FrameReason, int> counts;
  int num_without_partner = 0;
  for (const FrameRecord& frame : table.frames) {
    if (frame.reason != FrameReason::kNone) ++counts[frame.reason];
    num_without_partner += is_without_partner(frame);
  }
  if (num_without_partner > 0) {
    reporter.info(fmt::format("used with camera 0 alone, as other files could not be read: {}",
                              count_of(num_without_partner, "frame")));
  }
  if (counts.empty()) return;
  std::vector<std::pair<FrameReason, int>> sorted(counts.begin(), counts.end());
  std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    return a.second > b.second;
  });
  std::string text;
  for (const auto& [reason, count] : sorted) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, to_string(reason));
  }
  reporter.info("without a pose: " + text);
}

void report_advice(Reporter& reporter, const RunSummary& summary) {
  for (const RunAdvice& advice : summary.advice) {
    reporter.info(
        fmt::format("{}; try: {} ({})", advice.seen, advice.remedy, documentation(advice.see)));
  }
}

int run_and_log(const ReportOptions& options, const std::function<int(Reporter&)>& work) {
  silence_image_library();
  Reporter reporter(options.verbosity(), options.log);
  catch_interrupts();
  try {
    const int status = work(reporter);
    reporter.check_log();
    return status;
  } catch (const std::exception&) {
    reporter.failure(describe_failure(std::current_exception()));
    throw;
  }
}

void check_finished(const SessionResults& results) {
  if (results.failure) throw OutputError(describe_failure(results.failure));
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

#include "reporter.h"
#include "waymark/calibrate/calibrate.h"
#include "waymark/results/results.h"
#include "waymark/session/frame_feed.h"
#include "waymark/session/session.h"
#include "waymark/session/session_options.h"

namespace CLI {
class App;
}

/// What commands that read an INPUT have in common.
namespace waymark {

struct ReportOptions {
  std::filesystem::path out = "waymark-out";
  std::filesystem::path log;
  bool is_quiet = false;
  bool is_verbose = false;

  Verbosity verbosity() const {
    if (is_quiet) return Verbosity::kQuiet;
    return is_verbose ? Verbosity::kVerbose : Verbosity::kNormal;
  }
};

/// INPUT. Where it is "-" the list of images is read while the command line is.
void add_input_argument(CLI::App& command, std::filesystem::path& input, InputOptions& reading);
/// --rotate and --resize.
void add_change_options(CLI::App& command, InputOptions& reading);
/// INPUT and how to read it.
void add_reading_options(CLI::App& command, std::filesystem::path& input, InputOptions& reading);
/// The same, its cameras, the settings.
void add_input_options(CLI::App& command, SessionOptions& options);
/// Which part of the input and of the images.
void add_selection_options(CLI::App& command, InputOptions& reading);
/// --fov, of inputs that carry no calibration.
void add_fov_option(CLI::App& command, CalibrateOptions& options);
/// Where results and messages go, and the seed.
void add_report_options(CLI::App& command, ReportOptions& options, std::optional<int>& seed);

/// Tells that the results of an earlier run go.
void report_replacement(Reporter& reporter, const ReportOptions& options);

/// Lets a calibration tell what it does, and be interrupted.
CalibrateOptions reported(CalibrateOptions options, Reporter& reporter);

/// Warns where the images of an input without a calibration do not tell it. what: to expect.
void warn_unless_sure(Reporter& reporter, const PreparedInput& prepared, std::string_view what);

/// What the input was, in the end, and what became of its calibration.
void add_input(const PreparedInput& prepared, RunSummary& summary);
/// Tells what the images have changed beyond doubt, in one line, if anything.
void report_calibration(Reporter& reporter, const RunSummary& summary);
/// Writes calibration.yaml, for -c: the rig in use. Nothing where it was given and the images do
/// not contradict it.
void write_calibration(const std::filesystem::path& folder,
                       const PreparedInput& prepared,
                       const Rig& rig,
                       const RunSummary& summary);

/// Tells of every frame.
FrameObserver report_frames(Reporter& reporter, const InputInfo& info);

/// Why frames have no pose, the commonest reason first, how many came without their depth, and
/// whether a video ended early; nothing if there are none.
void report_reasons(Reporter& reporter, const FrameTable& table, const RunSummary& summary);

/// What to try, a line each; nothing where all went well.
void report_advice(Reporter& reporter, const RunSummary& summary);

/// Calls work with a reporter and from then on catches interrupts; what it throws also goes to the
/// log.
int run_and_log(const ReportOptions& options, const std::function<int(Reporter&)>& work);

/// Throws OutputError if something ended the session before its input did.
void check_finished(const SessionResults& results);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "commands.h"
#include "input_command.h"
#include "numbers.h"
#include "paths.h"
#include "reporter.h"
#include "terminal.h"
#include "waymark/base/atomic_file.h"
#include "waymark/calibrate/calibrate.h"

namespace waymark {
namespace {

struct CalibrateCommand {
  std::filesystem::path input;
  InputOptions reading;
  CalibrateOptions calibrate;
  std::filesystem::path out;  ///< Empty: the calibration is printed only.
  ReportOptions report;
};

int calibrate_input(CalibrateCommand options, Reporter& reporter) {
  options.reading.setup = Setup::kMono;
  options.reading.enlarges_small = true;
  if (!options.out.empty()) AtomicFile{options.out};  // Fails now rather than in the end.
  const std::unique_ptr<Input> input = open_input(options.input, options.reading);
  const EstimatedCalibration calibration = calibrate(*input, reported(options.calibrate, reporter));
  for (const std::string& line : report(calibration)) print_result("{}\n", line);
  if (options.reading.rotate_deg || options.reading.resize_px || input->info().enlargement > 1) {
    const InputInfo& info = input->info();
    print_result("images: as turned or resized, {}x{} px{}\n",
                 info.width_px,
                 info.height_px,
                 options.out.empty() ? "" : "; the file is of them as they are");
  }
  if (!calibration.is_sure) reporter.warning("calibration: " + calibration.reason);
  if (!options.out.empty())
    write_file_atomically(options.out,
                          format_camchain(input->of_unchanged_images(calibration.chain())));
  return kDone;
}

}  // namespace

void add_calibrate_command(CLI::App& program, Command& command) {
  const auto options = std::make_shared<CalibrateCommand>();
  CLI::App& calibrate_command = *program.add_subcommand(
      "calibrate", "Find the camera model and calibration of INPUT from its images");
  add_input_argument(calibrate_command, options->input, options->reading);
  writes(calibrate_command.add_option(
      "-o,--out", options->out, "Write the calibration to this file, for -c [not written]"));
  calibrate_command.option_defaults()->group("Input");
  add_change_options(calibrate_command, options->reading);
  add_fov_option(calibrate_command, options->calibrate);
  add_selection_options(calibrate_command, options->reading);
  calibrate_command.option_defaults()->group("Results and messages");
  calibrate_command.add_option("--seed", options->calibrate.seed, "Seed of all random numbers [0]")
      ->check(CLI::Range(0, 1000000000));
  calibrate_command.add_flag("--quiet", options->report.is_quiet, "No messages but errors [off]");
  calibrate_command.callback([options, &command] {
    command = [options] {
      return run_and_log(options->report,
                         [&](Reporter& reporter) { return calibrate_input(*options, reporter); });
    };
  });
}

}  // namespace waymark

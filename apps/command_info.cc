// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include "commands.h"
#include "input_command.h"
#include "terminal.h"
#include "waymark/input/input_report.h"

namespace waymark {
namespace {

struct InfoCommand {
  std::filesystem::path input;
  InputOptions reading;
  bool is_json = false;
};

int show_input(const InfoCommand& options) {
  const InputInfo info = open_input(options.input, options.reading)->info();
  print_result("{}", options.is_json ? format_input_json(info) : format_input(info));
  return kDone;
}

}  // namespace

void add_info_command(CLI::App& program, Command& command) {
  const auto options = std::make_shared<InfoCommand>();
  CLI::App& info = *program.add_subcommand(
      "info", "Say what INPUT holds: cameras, sizes, rate, gaps, calibration, topics");
  add_reading_options(info, options->input, options->reading);
  info.option_defaults()->group("Results and messages");
  info.add_flag("--json", options->is_json, "Print one JSON object");
  info.callback([options, &command] { command = [options] { return show_input(*options); }; });
}

}  // namespace waymark

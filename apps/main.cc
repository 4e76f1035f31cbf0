// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// The command line: one program, a subcommand per task. Exit status and form of errors are the same
// for all of them.
#include <fmt/format.h>
#include <signal.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include "commands.h"
#include "paths.h"
#include "terminal.h"
#include "waymark/base/check.h"
#include "waymark/base/failure.h"
#include "waymark/input/config_file.h"

namespace waymark {
namespace {

/// One line, whatever the message holds.
int fail(int status, std::string message) {
  std::replace(message.begin(), message.end(), '\n', ' ');
  print_message("error: {}\n", message);
  return status;
}

/// The parser itself would say only that a command is missing.
void check_command_name(const CLI::App& program, const std::vector<std::string>& arguments) {
  const std::string name = arguments.empty() ? "" : arguments.front();
  if (name.empty() || name.front() == '-') return;
  std::string known;
  for (const CLI::App* command : program.get_subcommands({})) {
    if (command->get_name() == name) return;
    known += (known.empty() ? "" : ", ") + command->get_name();
  }
  throw InputError("command line", fmt::format("unknown command '{}', expected {}", name, known));
}

/// "waymark map merge": as far as the command line was understood.
std::string name_of(const CLI::App& program) {
  std::string name = program.get_name();
  for (const CLI::App* below = &program; !below->get_subcommands().empty();) {
    below = below->get_subcommands().front();
    name += " " + below->get_name();
  }
  return name;
}

int run_program(const std::vector<std::string>& arguments) {
  CLI::App program("Waymark: visual SLAM for any camera.", "waymark");
  program.require_subcommand(1);
  program.set_version_flag("--version", std::string("waymark ") + WAYMARK_VERSION);
  program.get_formatter()->column_width(34);
  program.footer(
      "Exit status: 0 done, 1 could not finish, 2 bad usage, settings or input, 3 no pose");

  Command command;
  add_demo_command(program, command, run_program);
  add_run_command(program, command);
  add_info_command(program, command);
  add_localize_command(program, command);
  add_map_command(program, command);
  add_atlas_command(program, command);
  add_fleet_command(program, command);
  add_view_command(program, command);
  add_eval_command(program, command);
  add_report_command(program, command);
  add_simulate_command(program, command);
  add_export_command(program, command);
  add_import_command(program, command);
  add_calibrate_command(program, command);
  add_config_command(program, command);
  add_markers_command(program, command);

  std::vector<std::string> words;
  CLI::App& help = *program.add_subcommand("help", "Say what a command does, and its options");
  help.add_option("COMMAND", words, "As it is given, with its task if it has some");
  help.callback([&] {
    words.push_back("--help");
    command = [&] { return run_program(words); };
  });

  check_command_name(program, arguments);
  try {
    program.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::Success& help_or_version) {
    return program.exit(help_or_version);
  } catch (const CLI::ParseError& error) {
    return fail(kBadInput,
                fmt::format("command line: {}, see {} --help", error.what(), name_of(program)));
  }
  protect_inputs(program);
  return command();
}

}  // namespace
}  // namespace waymark

int main(int argc, char** argv) {
  waymark::keep_standard_streams();
  // A reader who leaves or a file size limit would end the program: without the signals the write
  // fails, and what was computed is saved.
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);
  waymark::silence_libraries();
  try {
    const int status = waymark::run_program({argv + 1, argv + argc});
    if (status == waymark::kDone || status == waymark::kNoPose) waymark::check_standard_output();
    return status;
  } catch (const waymark::InputError& error) {
    return waymark::fail(waymark::kBadInput, error.what());
  } catch (const std::filesystem::filesystem_error&) {
    return waymark::fail(waymark::kBadInput, waymark::describe_failure(std::current_exception()));
  } catch (const std::exception&) {
    return waymark::fail(waymark::kCouldNotFinish,
                         waymark::describe_failure(std::current_exception()));
  }
}

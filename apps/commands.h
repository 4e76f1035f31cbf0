// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace waymark {

/// What a parsed command line is to do; returns the exit status.
using Command = std::function<int()>;

/// The program itself: from arguments, the name of a command first, to the exit status. Throws
/// InputError and OutputError.
using Program = std::function<int(const std::vector<std::string>&)>;

/// Each adds one subcommand with its options and, once parsed, leaves in command what to do.
void add_run_command(CLI::App& program, Command& command);
void add_localize_command(CLI::App& program, Command& command);
void add_map_command(CLI::App& program, Command& command);
void add_atlas_command(CLI::App& program, Command& command);
void add_fleet_command(CLI::App& program, Command& command);
void add_markers_command(CLI::App& program, Command& command);
void add_calibrate_command(CLI::App& program, Command& command);
void add_eval_command(CLI::App& program, Command& command);
void add_report_command(CLI::App& program, Command& command);
void add_simulate_command(CLI::App& program, Command& command);
void add_config_command(CLI::App& program, Command& command);
void add_export_command(CLI::App& program, Command& command);
void add_import_command(CLI::App& program, Command& command);
void add_info_command(CLI::App& program, Command& command);
void add_view_command(CLI::App& program, Command& command);
void add_demo_command(CLI::App& program, Command& command, Program run_program);

/// Exit status of the program.
inline constexpr int kDone = 0;
inline constexpr int kCouldNotFinish = 1;  ///< Internal failure, or output cannot be written.
inline constexpr int kBadInput = 2;        ///< Bad usage, settings or input.
inline constexpr int kNoPose = 3;          ///< Ran, but found no pose at all.

/// What `map` has besides; adds one subcommand to it.
void add_align_task(CLI::App& maps, Command& command);

/// What `atlas info` and `atlas check` do.
int print_atlas_info(const std::filesystem::path& folder);
int check_atlas(const std::filesystem::path& folder);

/// How many keyframes a tile has at most.
void add_tile_size_option(CLI::App& command, std::size_t& num_keyframes);

/// Adds an option that takes one of a few names, each standing for a value.
template <class Value>
void add_choice(CLI::App& command,
                const std::string& name,
                Value& value,
                const std::map<std::string, Value>& choices,
                const std::string& help) {
  command
      .add_option_function<std::string>(
          name, [&value, choices](const std::string& chosen) { value = choices.at(chosen); }, help)
      ->check(CLI::IsMember(choices))
      ->type_name("NAME");
}

/// From now on the first Ctrl-C, SIGTERM or SIGHUP is remembered, and a further Ctrl-C or SIGTERM
/// ends the program at once with status 130. A terminal that is lost hangs up more than once.
void catch_interrupts();

/// Whether the user asked to end early.
bool is_interrupted();

}  // namespace waymark

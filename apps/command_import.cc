// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Importing is a tool in Python: here its command line is read, like all others, and handed on.
#include <memory>
#include <string>

#include "commands.h"
#include "paths.h"
#include "python_tool.h"

namespace waymark {
namespace {

struct ImportOptions {
  std::string map;
  std::string settings;
  std::string out;
};

}  // namespace

void add_import_command(CLI::App& program, Command& command) {
  const auto options = std::make_shared<ImportOptions>();
  CLI::App& importing = *program.add_subcommand(
      "import", "Take over a map of OpenVSLAM or stella_vslam, or the cameras of its settings");
  reads(importing.add_option("MAP", options->map, "Map file (.msg, .db)"));
  writes(
      importing.add_option("-o,--out", options->out, "Map file to write; without MAP a camchain"));
  reads(importing.add_option(
      "--settings",
      options->settings,
      "Settings of the same program (YAML); without MAP they become a camchain"));
  importing.callback([options, &command] {
    command = [options]() -> int {
      become_python_tool("importing", "", {options->map, options->settings, options->out});
    };
  });
}

}  // namespace waymark

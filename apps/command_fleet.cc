// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// The fleet is a program in Python: here its command line is read, like all others, and handed on.
#include <memory>
#include <string>
#include <vector>

#include "commands.h"
#include "paths.h"
#include "python_tool.h"
#include "waymark/atlas/add.h"

namespace waymark {
namespace {

struct FleetOptions {
  std::vector<std::string> recordings;
  std::string out;
  std::string workers;
  std::string scheduler;
  std::string work;
  std::string report;
  std::vector<std::string> configs;
  std::vector<std::string> settings;
  std::string setup;
  std::size_t num_keyframes = kKeyframesPerTile;
  std::uint64_t seed = 0;
};

std::vector<std::string> words_of(const FleetOptions& options) {
  std::vector<std::string> words = {"--out", options.out};
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) words.insert(words.end(), {name, value});
  };
  add("--workers", options.workers);
  add("--scheduler", options.scheduler);
  add("--work", options.work);
  add("--report", options.report);
  for (const std::string& config : options.configs) add("--config", config);
  for (const std::string& setting : options.settings) add("--set", setting);
  add("--setup", options.setup);
  add("--keyframes", std::to_string(options.num_keyframes));
  add("--seed", std::to_string(options.seed));
  words.push_back("--");
  words.insert(words.end(), options.recordings.begin(), options.recordings.end());
  return words;
}

}  // namespace

void add_fleet_command(CLI::App& program, Command& command) {
  const auto options = std::make_shared<FleetOptions>();
  CLI::App& fleet = *program.add_subcommand(
      "fleet", "Map many recordings by many processes or machines, and make one atlas of them");
  reads(fleet.add_option("RECORDING", options->recordings, "What run takes, or map files"))
      ->required();
  writes(fleet.add_option("-o,--out", options->out, "Folder of the atlas"))
      ->required()
      ->type_name("ATLAS");
  CLI::Option* const workers =
      fleet.add_option("--workers", options->workers, "Processes of this machine [one per core]")
          ->check(CLI::Range(1, 4096))
          ->type_name("N");
  fleet.add_option("--scheduler", options->scheduler, "Address of a Dask scheduler to work for")
      ->type_name("ADDRESS")
      ->excludes(workers);
  fleet.add_option("--work", options->work, "Where steps leave what they made [ATLAS/work]")
      ->type_name("URL");
  writes(fleet.add_option("--report", options->report, "Write a page on what became of each"))
      ->type_name("FILE");
  reads(fleet.add_option("-c,--config", options->configs, "As for run, the same for all"))
      ->type_name("FILE");
  fleet.add_option("--set", options->settings, "As for run")->type_name("KEY=VALUE");
  fleet.add_option("--setup", options->setup, "As for run")->type_name("NAME");
  add_tile_size_option(fleet, options->num_keyframes);
  fleet.add_option("--seed", options->seed, "Of random numbers [0]");
  fleet.callback([options, &command] {
    command = [options]() -> int {
      become_python_tool("fleet", "distributed,fsspec", words_of(*options));
    };
  });
}

}  // namespace waymark

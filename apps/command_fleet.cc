// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// The fleet is a program in Python: here its command line is read, like all others, and handed on.
#include <stdlib.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "commands.h"
#include "waymark/atlas/add.h"
#include "waymark/base/check.h"

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
  std::vector<std::string> words = {"-m", "waymark.fleet", "--out", options.out};
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

/// Goes on to the fleet if all of its modules are there; Python itself would say in many words that
/// one is not.
constexpr const char* kStart = R"(
import importlib.util, os, sys
needed = {"waymark": "it installed, or its folder in PYTHONPATH", "distributed": "the package python3-distributed",
          "fsspec": "the package python3-fsspec"}
for module, expected in needed.items():
    if importlib.util.find_spec(module) is None:
        print(f"error: {sys.executable}: no module {module}, expected {expected}", file=sys.stderr)
        sys.exit(2)
os.execv(sys.executable, [sys.executable, *sys.argv[1:]])
)";

/// The module of a program lies in its build folder, or below the same prefix; Python looks there
/// after what PYTHONPATH names.
void let_python_find_module(const std::filesystem::path& program) {
  const std::filesystem::path folder = program.parent_path();
  const auto prefix = folder.parent_path();
  for (const auto& modules : {folder / "python", prefix / "lib/python3/dist-packages"}) {
    std::error_code error;
    if (!std::filesystem::exists(modules / "waymark/fleet.py", error)) continue;
    const char* const named = std::getenv("PYTHONPATH");
    const std::string before = named && *named ? std::string(named) + ":" : "";
    ::setenv("PYTHONPATH", (before + modules.string()).c_str(), /*overwrite=*/1);
    return;
  }
}

/// Becomes the other program, whose exit status is ours.
int run_fleet(const FleetOptions& options) {
  std::error_code error;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
  if (!error) {
    ::setenv("WAYMARK_PROGRAM", self.c_str(), /*overwrite=*/0);
    let_python_find_module(self);
  }
  // Modules of the distribution are for its own Python.
  const char* const python =
      ::access("/usr/bin/python3", X_OK) == 0 ? "/usr/bin/python3" : "python3";
  std::vector<std::string> words = words_of(options);
  words.insert(words.begin(), {python, "-c", kStart});
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  ::execvp(python, arguments.data());
  throw InputError("python3", "cannot be run, expected Python with the module waymark");
}

}  // namespace

void add_fleet_command(CLI::App& program, Command& command) {
  const auto options = std::make_shared<FleetOptions>();
  CLI::App& fleet = *program.add_subcommand(
      "fleet", "Map many recordings by many processes or machines, and make one atlas of them");
  fleet.add_option("RECORDING", options->recordings, "What run takes, or map files")->required();
  fleet.add_option("-o,--out", options->out, "Folder of the atlas")->required()->type_name("ATLAS");
  CLI::Option* const workers =
      fleet.add_option("--workers", options->workers, "Processes of this machine [one per core]")
          ->check(CLI::Range(1, 4096))
          ->type_name("N");
  fleet.add_option("--scheduler", options->scheduler, "Address of a Dask scheduler to work for")
      ->type_name("ADDRESS")
      ->excludes(workers);
  fleet.add_option("--work", options->work, "Where steps leave what they made [ATLAS/work]")
      ->type_name("URL");
  fleet.add_option("--report", options->report, "Write a page on what became of each")
      ->type_name("FILE");
  fleet.add_option("-c,--config", options->configs, "As for run, the same for all")
      ->type_name("FILE");
  fleet.add_option("--set", options->settings, "As for run")->type_name("KEY=VALUE");
  fleet.add_option("--setup", options->setup, "As for run")->type_name("NAME");
  add_tile_size_option(fleet, options->num_keyframes);
  fleet.add_option("--seed", options->seed, "Of random numbers [0]");
  fleet.callback([options, &command] { command = [options] { return run_fleet(*options); }; });
}

}  // namespace waymark

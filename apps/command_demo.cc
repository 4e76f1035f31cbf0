// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "commands.h"
#include "terminal.h"
#include "waymark/input/input.h"

namespace waymark {
namespace {

struct DemoOptions {
  std::filesystem::path out = "waymark-demo";
  std::string world = "apartment";
  std::string camera;  ///< Empty: what suits the setup.
  Setup setup = Setup::kMono;
  int num_frames = 0;  ///< 0: as many as `waymark simulate` makes.
  std::string port = "8080";
  bool is_once = false;
};

using Arguments = std::vector<std::string>;

Arguments simulate_command(const DemoOptions& options) {
  Arguments command = {"simulate", options.world, "--setup", std::string(to_string(options.setup))};
  const std::string camera =
      options.camera.empty() && options.setup == Setup::kMono ? "equirectangular" : options.camera;
  if (!camera.empty()) command.insert(command.end(), {"--camera", camera});
  if (options.num_frames > 0) {
    command.insert(command.end(), {"--frames", std::to_string(options.num_frames)});
  }
  command.insert(command.end(), {"-o", options.out / "sequence"});
  return command;
}

/// The demo in commands that people can give themselves.
std::vector<Arguments> commands_of(const DemoOptions& options, bool stays) {
  const std::filesystem::path sequence = options.out / "sequence", map = options.out / "map.wmap";
  std::vector<Arguments> commands = {simulate_command(options),
                                     {"run",
                                      sequence,
                                      "-c",
                                      sequence / "camchain.yaml",
                                      "--pace",
                                      "--viewer",
                                      options.port,
                                      "-o",
                                      options.out,
                                      "--map-out",
                                      map},
                                     {"eval",
                                      options.out / "trajectory.txt",
                                      sequence / "groundtruth.txt",
                                      // One camera does not know the scale.
                                      "--align",
                                      options.setup == Setup::kMono ? "sim3" : "se3",
                                      "--plot",
                                      options.out / "trajectory.svg"}};
  if (stays) commands.push_back({"view", map, "--port", options.port});
  return commands;
}

int demo(const DemoOptions& options, const Program& program) {
  const bool stays = !options.is_once && isatty(STDOUT_FILENO) != 0;
  for (const Arguments& command : commands_of(options, stays)) {
    if (is_interrupted()) break;
    print_result("\nwaymark {}\n", fmt::join(command, " "));
    std::fflush(stdout);
    if (const int status = program(command); status != kDone) return status;
  }
  return kDone;
}

}  // namespace

void add_demo_command(CLI::App& program, Command& command, Program run_program) {
  const auto options = std::make_shared<DemoOptions>();
  CLI::App& demo_command = *program.add_subcommand(
      "demo", "Simulate what a camera sees, map it live in the browser, leave the map open there");
  demo_command.add_option("-o,--out", options->out, "Folder for images, results and map")
      ->capture_default_str();
  demo_command.add_option("--world", options->world, "See waymark simulate --list")
      ->capture_default_str();
  demo_command.add_option(
      "--camera",
      options->camera,
      "Camchain file, or a name, see waymark simulate --list [mono: equirectangular, 360 degrees]");
  add_choice<Setup>(demo_command,
                    "--setup",
                    options->setup,
                    {{"mono", Setup::kMono}, {"stereo", Setup::kStereo}, {"rgbd", Setup::kRgbd}},
                    "mono, stereo or rgbd [mono]");
  demo_command.add_option("--frames", options->num_frames, "Number of frames [as simulate]")
      ->check(CLI::Range(1, 1000000));
  demo_command.add_option("--port", options->port, "[HOST:]PORT to serve the page at")
      ->type_name("[HOST:]PORT")
      ->capture_default_str();
  demo_command.add_flag(
      "--once",
      options->is_once,
      "End when the map is there [until Ctrl-C, if standard output is a terminal]");
  demo_command.callback([options, &command, run_program = std::move(run_program)] {
    command = [options, run_program] { return demo(*options, run_program); };
  });
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "commands.h"
#include "terminal.h"
#include "waymark/base/atomic_file.h"
#include "waymark/exchange/trajectory.h"
#include "waymark/report/report.h"

namespace waymark {
namespace {

struct PageOptions {
  std::vector<std::filesystem::path> folders;
  std::filesystem::path groundtruth;
  std::optional<TrajectoryAlignment> alignment;
  std::filesystem::path out;
};

int write_page(const PageOptions& options) {
  std::vector<RunFolder> runs;
  for (const std::filesystem::path& folder : options.folders)
    runs.push_back(read_run_folder(folder));
  std::optional<TruePath> truth;
  if (!options.groundtruth.empty()) {
    truth = TruePath{options.groundtruth.filename().string(),
                     read_trajectory(options.groundtruth),
                     options.alignment};
  }
  const TruePath* const known = truth ? &*truth : nullptr;
  const bool is_one = runs.size() == 1;
  std::filesystem::path out = options.out;
  if (out.empty()) out = is_one ? options.folders.front() / "report.html" : "comparison.html";
  write_file_atomically(
      out, is_one ? format_report(runs.front(), known) : format_run_comparison(runs, known));
  print_result("{}\n", out.string());
  return kDone;
}

}  // namespace

void add_report_command(CLI::App& program, Command& command) {
  const auto options = std::make_shared<PageOptions>();
  CLI::App& report = *program.add_subcommand(
      "report", "Make a page for the browser of what a run left, or of several to compare");
  report
      .add_option("OUT", options->folders, "Folder that run or localize wrote; several to compare")
      ->required();
  report.add_option("--ground-truth",
                    options->groundtruth,
                    "True trajectory (TUM, EuRoC csv or KITTI) to compare with [none]");
  add_choice<std::optional<TrajectoryAlignment>>(
      report,
      "--align",
      options->alignment,
      {{"se3", TrajectoryAlignment::kSe3},
       {"sim3", TrajectoryAlignment::kSim3},
       {"none", TrajectoryAlignment::kNone}},
      "se3, sim3 (free scale) or none [sim3 where the run has no scale, else se3]");
  report.add_option(
      "-o,--out", options->out, "File to write [OUT/report.html; of several comparison.html]");
  report.callback([options, &command] { command = [options] { return write_page(*options); }; });
}

}  // namespace waymark

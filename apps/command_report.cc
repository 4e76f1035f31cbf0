// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <optional>

#include "commands.h"
#include "terminal.h"
#include "waymark/report/report.h"

namespace waymark {
namespace {

int report_runs(const PageRequest& request) {
  print_result("{}\n", write_page(request).string());
  return kDone;
}

}  // namespace

void add_report_command(CLI::App& program, Command& command) {
  const auto options = std::make_shared<PageRequest>();
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
  report.callback([options, &command] { command = [options] { return report_runs(*options); }; });
}

}  // namespace waymark

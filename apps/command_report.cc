// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <memory>
#include <optional>

#include "atlas_report.h"
#include "commands.h"
#include "paths.h"
#include "terminal.h"
#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/report/report.h"

namespace waymark {
namespace {

int report_atlas(const PageRequest& request) {
  if (request.folders.size() > 1 || !request.groundtruth.empty()) {
    throw InputError(request.folders.front().string(),
                     "is an atlas, expected it alone, without ground truth");
  }
  const std::filesystem::path out = request.out.empty() ? "atlas.html" : request.out;
  write_file_atomically(out, format_atlas_report(Atlas::open(request.folders.front())));
  print_result("{}\n", out.string());
  return kDone;
}

int report_runs(const PageRequest& request) {
  if (is_atlas(request.folders.front())) return report_atlas(request);
  print_result("{}\n", write_page(request).string());
  return kDone;
}

}  // namespace

void add_report_command(CLI::App& program, Command& command) {
  const auto options = std::make_shared<PageRequest>();
  CLI::App& report = *program.add_subcommand(
      "report", "Make a page for the browser of what a run left, or of several to compare");
  reads(report.add_option("OUT",
                          options->folders,
                          "Folder that run or localize wrote, several to compare; or of an atlas"))
      ->required();
  reads(report.add_option("--ground-truth",
                          options->groundtruth,
                          "True trajectory (TUM, EuRoC csv or KITTI) to compare with [none]"));
  add_choice<std::optional<TrajectoryAlignment>>(
      report,
      "--align",
      options->alignment,
      {{"se3", TrajectoryAlignment::kSe3},
       {"sim3", TrajectoryAlignment::kSim3},
       {"none", TrajectoryAlignment::kNone}},
      "se3, sim3 (free scale) or none [sim3 where the run has no scale, else se3]");
  writes(report.add_option(
      "-o,--out",
      options->out,
      "File to write [OUT/report.html; of several comparison.html, of an atlas atlas.html]"));
  report.callback([options, &command] { command = [options] { return report_runs(*options); }; });
}

}  // namespace waymark

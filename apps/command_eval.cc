// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "commands.h"
#include "terminal.h"
#include "waymark/base/atomic_file.h"
#include "waymark/evaluate/evaluation.h"
#include "waymark/evaluate/report.h"
#include "waymark/exchange/trajectory.h"

namespace waymark {
namespace {

struct EvalOptions {
  std::filesystem::path estimate;
  std::filesystem::path groundtruth;
  TrajectoryAlignment alignment = TrajectoryAlignment::kSe3;
  bool is_json = false;
  std::filesystem::path plot;
};

int evaluate_trajectory(const EvalOptions& options) {
  const std::vector<StampedPose> estimate = read_trajectory(options.estimate);
  const std::vector<StampedPose> groundtruth = read_trajectory(options.groundtruth);
  EvaluationOptions evaluation_options;
  evaluation_options.alignment = options.alignment;
  const Evaluation evaluation = evaluate(estimate, groundtruth, evaluation_options);
  if (!options.plot.empty()) {
    const std::string title = options.estimate.string();
    write_file_atomically(options.plot, plot_evaluation(evaluation, estimate, groundtruth, title));
  }
  const std::string report =
      options.is_json ? format_evaluation_json(evaluation) : format_evaluation(evaluation);
  print_result("{}", report);
  return kDone;
}

}  // namespace

void add_eval_command(CLI::App& program, Command& command) {
  const auto options = std::make_shared<EvalOptions>();
  CLI::App& eval =
      *program.add_subcommand("eval", "Compare a trajectory with the ground truth: ATE, RPE");
  eval.add_option("ESTIMATE", options->estimate, "Trajectory (TUM, EuRoC csv or KITTI)")
      ->required();
  eval.add_option("GROUNDTRUTH", options->groundtruth, "True trajectory (same formats)")
      ->required();
  add_choice<TrajectoryAlignment>(eval,
                                  "--align",
                                  options->alignment,
                                  {{"se3", TrajectoryAlignment::kSe3},
                                   {"sim3", TrajectoryAlignment::kSim3},
                                   {"none", TrajectoryAlignment::kNone}},
                                  "se3, sim3 (free scale, for mono) or none [se3]");
  eval.add_flag("--json", options->is_json, "Print one JSON object");
  eval.add_option("--plot", options->plot, "Draw both trajectories and the error to an SVG file");
  eval.callback(
      [options, &command] { command = [options] { return evaluate_trajectory(*options); }; });
}

}  // namespace waymark

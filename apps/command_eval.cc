// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include "commands.h"
#include "paths.h"
#include "terminal.h"
#include "waymark/base/text.h"
#include "waymark/evaluate/report.h"
#include "waymark/report/evaluate_files.h"

namespace waymark {
namespace {

struct EvalOptions {
  EvaluationRequest request;
  bool is_json = false;
};

/// "auto", or seconds.
void set_time_offset(EvaluationRequest& request, const std::string& text) {
  request.finds_time_offset = text == "auto";
  if (!request.finds_time_offset) request.time_offset_ns = *parse_seconds(text);
}

std::string check_time_offset(const std::string& text) {
  const std::optional<double> seconds = parse_number(text);
  const bool is_number = seconds && std::abs(*seconds) <= kMaxOffsetS && parse_seconds(text);
  if (text == "auto" || is_number) return "";
  return fmt::format("is {}, expected seconds or auto", text);
}

int evaluate_trajectory(const EvalOptions& options) {
  const FileEvaluation result = evaluate_files(options.request);
  if (options.is_json) {
    print_result("{}", format_evaluation_json(result.evaluation, result.notes));
    return kDone;
  }
  for (const std::string& note : result.notes) print_message("note: {}\n", note);
  print_result("{}", format_evaluation(result.evaluation));
  return kDone;
}

}  // namespace

void add_eval_command(CLI::App& program, Command& command) {
  const auto options = std::make_shared<EvalOptions>();
  CLI::App& eval =
      *program.add_subcommand("eval", "Compare a trajectory with the ground truth: ATE, RPE");
  EvaluationRequest& request = options->request;
  reads(eval.add_option("ESTIMATE", request.estimate, "Trajectory (TUM, EuRoC csv or KITTI)"))
      ->required();
  reads(eval.add_option("GROUNDTRUTH", request.groundtruth, "True trajectory (same formats)"))
      ->required();
  add_choice<std::optional<TrajectoryAlignment>>(
      eval,
      "--align",
      request.alignment,
      {{"se3", TrajectoryAlignment::kSe3},
       {"sim3", TrajectoryAlignment::kSim3},
       {"none", TrajectoryAlignment::kNone}},
      "se3, sim3 (free scale, for mono) or none [sim3 where summary.json beside ESTIMATE tells of "
      "a run without scale, else se3]");
  eval.add_option_function<std::string>(
          "--time-offset",
          [&request](const std::string& text) { set_time_offset(request, text); },
          "Seconds that are added to the times of ESTIMATE; auto: as its speeds agree best [0]")
      ->check(CLI::Validator(check_time_offset, "SECONDS|auto"))
      ->type_name("");
  eval.add_flag("--json", options->is_json, "Print one JSON object");
  writes(eval.add_option(
      "--plot", request.plot, "Draw both trajectories and the error to an SVG file"));
  eval.callback(
      [options, &command] { command = [options] { return evaluate_trajectory(*options); }; });
}

}  // namespace waymark

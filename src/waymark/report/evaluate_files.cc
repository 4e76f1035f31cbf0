// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/report/evaluate_files.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/evaluate/report.h"
#include "waymark/evaluate/time_offset.h"
#include "waymark/report/run_folder.h"

namespace waymark {
namespace {

/// A note is worth reading where it makes the error this much smaller.
constexpr double kMuchSmaller = 0.5;
/// A scale that is free is off by more, as a logarithm.
constexpr double kMinScale = 0.1;
/// Clocks that differ by less are those of one recording.
constexpr std::int64_t kMinOffsetNs = 5'000'000;

/// What the run that left the estimate says of itself; nothing where none did.
std::optional<RunSummary> summary_beside(const std::filesystem::path& estimate) {
  const std::filesystem::path path = estimate.parent_path() / "summary.json";
  if (!std::filesystem::is_regular_file(path)) return std::nullopt;
  try {
    return parse_summary_json(read_text_file(path, "the summary of a run"), path.string());
  } catch (const InputError&) {
    return std::nullopt;  // Of another program.
  }
}

/// The comparison with something else about it, where that is possible and much better.
std::optional<Evaluation> much_better(const TrajectoryPair& paths,
                                      const EvaluationOptions& options,
                                      const Evaluation& as_is) {
  try {
    const Evaluation other = evaluate(paths.estimate, paths.groundtruth, options);
    if (other.ate_m.rmse < kMuchSmaller * as_is.ate_m.rmse) return other;
  } catch (const InputError&) {
  }
  return std::nullopt;
}

std::string describe_offset(std::int64_t offset_ns) {
  return fmt::format("the clocks seem to be {} s apart, as the speeds agree with --time-offset {}",
                     format_offset(std::abs(offset_ns)),
                     format_offset(offset_ns));
}

/// Compares them; an InputError names the offset where the clocks have nothing in common.
Evaluation evaluate_as_is(const TrajectoryPair& paths, EvaluationOptions options) {
  try {
    return evaluate(paths.estimate, paths.groundtruth, options);
  } catch (const InputError&) {
    if (paths.is_by_line || options.time_offset_ns != 0) throw;
    const auto offset_ns = find_time_offset(paths.estimate, paths.groundtruth);
    if (!offset_ns) throw;
    options.time_offset_ns = *offset_ns;
    evaluate(paths.estimate, paths.groundtruth, options);
    throw InputError("evaluation",
                     "hardly a pose has a true one near in time; " + describe_offset(*offset_ns));
  }
}

void note_scale(const TrajectoryPair& paths,
                EvaluationOptions options,
                const Evaluation& as_is,
                std::vector<std::string>& notes) {
  if (options.alignment != TrajectoryAlignment::kSe3) return;
  options.alignment = TrajectoryAlignment::kSim3;
  const auto scaled = much_better(paths, options, as_is);
  if (!scaled || std::abs(std::log(scaled->groundtruth_from_estimate.scale)) < kMinScale) return;
  notes.push_back(fmt::format(
      "the scale is off: {:.4g} times as large the ATE is {:.4g} m (--align sim3, for what has no "
      "scale of its own, as of one camera)",
      scaled->groundtruth_from_estimate.scale,
      scaled->ate_m.rmse));
}

void note_clocks(const TrajectoryPair& paths,
                 EvaluationOptions options,
                 const Evaluation& as_is,
                 std::vector<std::string>& notes) {
  if (paths.is_by_line || options.time_offset_ns != 0) return;
  const auto offset_ns = find_time_offset(paths.estimate, paths.groundtruth);
  if (!offset_ns || std::abs(*offset_ns) < kMinOffsetNs) return;
  options.time_offset_ns = *offset_ns;
  const auto moved = much_better(paths, options, as_is);
  if (!moved) return;
  notes.push_back(
      fmt::format("{}: the ATE is {:.4g} m then", describe_offset(*offset_ns), moved->ate_m.rmse));
}

EvaluationOptions options_for(const EvaluationRequest& request,
                              const TrajectoryPair& paths,
                              std::vector<std::string>& notes) {
  EvaluationOptions options;
  options.is_by_line = paths.is_by_line;
  options.time_offset_ns = request.time_offset_ns;
  if (request.alignment) options.alignment = *request.alignment;
  const auto summary = request.alignment ? std::nullopt : summary_beside(request.estimate);
  if (summary) options.alignment = alignment_for(*summary);
  if (options.alignment == TrajectoryAlignment::kSim3 && summary) {
    notes.push_back("aligned by sim3, as the run beside the estimate has no scale of its own");
  }
  if (paths.is_by_line) notes.push_back("neither file has times: compared line by line");
  if (!request.finds_time_offset) return options;
  const auto offset_ns =
      paths.is_by_line ? std::nullopt : find_time_offset(paths.estimate, paths.groundtruth);
  if (!offset_ns) {
    throw InputError("--time-offset",
                     "auto found no shift of the clocks at which the speeds agree, expected "
                     "seconds");
  }
  options.time_offset_ns = *offset_ns;
  return options;
}

FileEvaluation compare(const TrajectoryPair& paths, const EvaluationRequest& request) {
  FileEvaluation result;
  const EvaluationOptions options = options_for(request, paths, result.notes);
  result.evaluation = evaluate_as_is(paths, options);
  note_scale(paths, options, result.evaluation, result.notes);
  note_clocks(paths, options, result.evaluation, result.notes);
  if (!request.plot.empty()) {
    write_file_atomically(
        request.plot,
        plot_evaluation(
            result.evaluation, paths.estimate, paths.groundtruth, request.estimate.string()));
  }
  return result;
}

}  // namespace

TrajectoryAlignment alignment_for(const RunSummary& summary) {
  const bool is_free = summary.quality && !summary.quality->is_metric;
  return is_free ? TrajectoryAlignment::kSim3 : TrajectoryAlignment::kSe3;
}

FileEvaluation evaluate_files(const EvaluationRequest& request) {
  return compare(read_trajectories(request.estimate, request.groundtruth), request);
}

FileEvaluation evaluate_poses(std::span<const StampedPose> estimate,
                              const EvaluationRequest& request) {
  return compare({{estimate.begin(), estimate.end()}, read_trajectory(request.groundtruth), false},
                 request);
}
}  // namespace waymark

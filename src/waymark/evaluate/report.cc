// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/evaluate/report.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace waymark {
namespace {

using Json = nlohmann::ordered_json;

double rounded(double value) { return std::round(value * 1e6) / 1e6; }

Json to_json(const SegmentError& error) {
  return {{"t_percent", rounded(error.translation_percent)},
          {"r_deg_per_100m", rounded(error.rotation_deg_per_100m)},
          {"num_segments", error.num_segments}};
}

Json to_json(const std::optional<SegmentErrors>& segments) {
  if (!segments) return nullptr;
  Json json = to_json(segments->all);
  json["by_length"] = Json::array();
  for (const SegmentError& error : segments->by_length) {
    Json entry = {{"length_m", error.length_m}};
    entry.update(to_json(error));
    json["by_length"].push_back(entry);
  }
  return json;
}

}  // namespace

std::string format_offset(std::int64_t offset_ns) {
  return fmt::format("{:.14g}", std::round(1e-5 * static_cast<double>(offset_ns)) * 1e-4);
}

std::string format_evaluation(const Evaluation& evaluation) {
  const ErrorStatistics& ate = evaluation.ate_m;
  std::string text = fmt::format("pairs      {} of {} poses, coverage {:.1f} %\n",
                                 evaluation.num_pairs,
                                 evaluation.num_estimate_poses,
                                 100.0 * evaluation.coverage);
  if (evaluation.time_offset_ns != 0) {
    text += fmt::format("clocks     {} s added to the times of the estimate\n",
                        format_offset(evaluation.time_offset_ns));
  }
  text += fmt::format("alignment  {}, scale {:.5f}\n",
                      to_string(evaluation.alignment),
                      evaluation.groundtruth_from_estimate.scale);
  text += fmt::format("ATE        rmse {:.4f} m, mean {:.4f} m, median {:.4f} m, max {:.4f} m\n",
                      ate.rmse,
                      ate.mean,
                      ate.median,
                      ate.max);
  if (evaluation.ate_percent) {
    text += fmt::format("           {:.3f} % of a path of {:.2f} m\n",
                        *evaluation.ate_percent,
                        evaluation.path_length_m);
  }
  text += fmt::format("RPE        {:.4f} m, {:.4f} deg between consecutive pairs (rmse)\n",
                      evaluation.rpe_m,
                      evaluation.rpe_deg);
  if (!evaluation.segments) return text;
  for (const SegmentError& error : evaluation.segments->by_length) {
    text += fmt::format("segments   {:.0f} m: {:.3f} %, {:.3f} deg per 100 m\n",
                        error.length_m,
                        error.translation_percent,
                        error.rotation_deg_per_100m);
  }
  const SegmentError& all = evaluation.segments->all;
  text += fmt::format("           all: {:.3f} %, {:.3f} deg per 100 m, {} segments\n",
                      all.translation_percent,
                      all.rotation_deg_per_100m,
                      all.num_segments);
  return text;
}

std::string format_evaluation_json(const Evaluation& evaluation,
                                   std::span<const std::string> notes) {
  Json json;
  json["pairs"] = evaluation.num_pairs;
  json["poses"] = evaluation.num_estimate_poses;
  json["coverage"] = rounded(evaluation.coverage);
  json["align"] = to_string(evaluation.alignment);
  json["time_offset_s"] = rounded(1e-9 * static_cast<double>(evaluation.time_offset_ns));
  json["scale"] = rounded(evaluation.groundtruth_from_estimate.scale);
  json["path_length_m"] = rounded(evaluation.path_length_m);
  json["ate_rmse_m"] = rounded(evaluation.ate_m.rmse);
  json["ate_mean_m"] = rounded(evaluation.ate_m.mean);
  json["ate_median_m"] = rounded(evaluation.ate_m.median);
  json["ate_max_m"] = rounded(evaluation.ate_m.max);
  json["ate_percent"] =
      evaluation.ate_percent ? Json(rounded(*evaluation.ate_percent)) : Json(nullptr);
  json["rpe_m"] = rounded(evaluation.rpe_m);
  json["rpe_deg"] = rounded(evaluation.rpe_deg);
  json["segments"] = to_json(evaluation.segments);
  json["notes"] = notes;
  return json.dump(2) + "\n";
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "waymark/base/check.h"
#include "waymark/base/median.h"
#include "waymark/report/drawing.h"
#include "waymark/report/page.h"
#include "waymark/report/report.h"

namespace waymark {
namespace {

constexpr std::size_t kNumColors = 6;

/// A run and what it is laid over.
struct ComparedRun {
  const RunFolder* run;
  std::optional<Evaluation> error;  ///< Against the ground truth, where there is one.
  Sim3 shown_from_world;            ///< Into the frame of the ground truth or of the first run.
  std::string note;                 ///< Why it is not laid over the others; empty: it is.
};

/// By equal times; as it is where there are too few.
void lay_over_first(const RunFolder& first, ComparedRun& compared) {
  const TruePath path{first.name, first.trajectories.front(), std::nullopt};
  const RunFolder& run = *compared.run;
  if (run.trajectories.front().empty() || path.poses.empty()) return;
  EvaluationOptions options;
  const bool is_metric = length_unit(first) == "m" && length_unit(run) == "m";
  options.alignment = is_metric ? TrajectoryAlignment::kSe3 : TrajectoryAlignment::kSim3;
  try {
    compared.shown_from_world =
        evaluate(run.trajectories.front(), path.poses, options).groundtruth_from_estimate;
  } catch (const InputError&) {
    compared.note = fmt::format(
        "{} has too few times in common with {} to be laid over it.", run.name, first.name);
  }
}

std::vector<ComparedRun> compare(std::span<const RunFolder> runs, const TruePath* truth) {
  std::vector<ComparedRun> compared;
  for (const RunFolder& run : runs) {
    ComparedRun& one = compared.emplace_back(ComparedRun{&run, std::nullopt, Sim3(), ""});
    if (truth && !run.trajectories.front().empty()) {
      one.error = evaluate_run(run, *truth);
      one.shown_from_world = one.error->groundtruth_from_estimate;
    } else if (!truth && &run != &runs.front()) {
      lay_over_first(runs.front(), one);
    }
  }
  return compared;
}

std::string style_of(std::size_t index) {
  return fmt::format("class=\"path{}\"", index % kNumColors);
}

/// A line as in the drawings, and the name.
std::string key_of(std::size_t index, const RunFolder& run) {
  return fmt::format(
      "<svg viewBox=\"0 0 24 6\" class=\"key-line\" aria-hidden=\"true\"><path {} d=\"M0 "
      "3H24\"/></svg>{}",
      style_of(index),
      escaped(run.name));
}

std::string inliers_in_median(const RunFolder& run) {
  std::vector<int> inliers;
  for (const FrameRecord& frame : run.table.frames) {
    if (frame.state == FrameState::kTracked) inliers.push_back(frame.num_inliers);
  }
  return inliers.empty() ? "-" : fmt::format("{}", median(inliers));
}

/// A row of the table: what it is, and how a run's value is written.
struct ComparedFigure {
  const char* name;
  std::function<std::string(const ComparedRun&)> value;
};

std::vector<ComparedFigure> figures_of_frames() {
  return {
      {"Verdict",
       [](const ComparedRun& one) {
         const Assessment verdict =
             judge(one.run->table, one.run->summary, one.error ? &*one.error : nullptr);
         return badge(verdict.grade);
       }},
      {"Frames",
       [](const ComparedRun& one) { return fmt::format("{}", one.run->summary.counts.frames); }},
      {"Coverage",
       [](const ComparedRun& one) {
         const RunSummary& summary = one.run->summary;
         return fmt::format(
             "{:.1f} %",
             100.0 * static_cast<double>(summary.num_trajectory_lines) /
                 static_cast<double>(std::max<std::size_t>(summary.counts.frames, 1)));
       }},
      {"Losses",
       [](const ComparedRun& one) {
         return fmt::format("{}", one.run->summary.counts.lost_count);
       }},
      {"Parts of the map",
       [](const ComparedRun& one) { return fmt::format("{}", one.run->summary.submaps); }},
      {"Loops", [](const ComparedRun& one) { return fmt::format("{}", one.run->summary.loops); }},
      {"Inliers, median", [](const ComparedRun& one) { return inliers_in_median(*one.run); }},
  };
}

std::vector<ComparedFigure> figures_of_map() {
  return {
      {"Keyframes",
       [](const ComparedRun& one) { return fmt::format("{}", one.run->summary.keyframes); }},
      {"Landmarks",
       [](const ComparedRun& one) { return fmt::format("{}", one.run->summary.landmarks); }},
      {"Reprojection error",
       [](const ComparedRun& one) -> std::string {
         const auto& quality = one.run->summary.quality;
         return quality ? fmt::format("{:.2f} px", quality->reprojection_px) : "-";
       }},
      {"Length",
       [](const ComparedRun& one) -> std::string {
         const auto& quality = one.run->summary.quality;
         return quality ? fmt::format("{:.4g} {}", quality->length, length_unit(*one.run)) : "-";
       }},
      {"Tracking, mean",
       [](const ComparedRun& one) {
         return fmt::format("{:.1f} ms", one.run->summary.tracking_ms.mean);
       }},
      {"Time by the clock",
       [](const ComparedRun& one) { return fmt::format("{:.1f} s", one.run->summary.wall_s); }},
      {"Memory at most",
       [](const ComparedRun& one) {
         return fmt::format("{:.0f} MB", one.run->summary.peak_rss_mb);
       }},
      {"Setup", [](const ComparedRun& one) { return escaped(one.run->summary.setup); }},
      {"Settings",
       [](const ComparedRun& one) {
         std::string text;
         for (const std::string& line : one.run->summary.settings) text += escaped(line) + "<br>";
         return text.empty() ? std::string("as by default") : text;
       }},
      {"Version", [](const ComparedRun& one) { return escaped(one.run->summary.version); }},
  };
}

std::vector<ComparedFigure> figures_of_error() {
  const auto with = [](std::string (*format)(const Evaluation&)) {
    return [format](const ComparedRun& one) {
      return one.error ? format(*one.error) : std::string("-");
    };
  };
  return {{"ATE",
           with([](const Evaluation& error) { return fmt::format("{:.4g} m", error.ate_m.rmse); })},
          {"ATE of the path", with([](const Evaluation& error) {
             return error.ate_percent ? fmt::format("{:.2g} %", *error.ate_percent)
                                      : std::string("-");
           })},
          {"RPE", with([](const Evaluation& error) {
             return fmt::format("{:.3g} m, {:.3g} degrees", error.rpe_m, error.rpe_deg);
           })}};
}

std::string figure_table(const std::vector<ComparedRun>& compared, bool has_truth) {
  std::vector<std::string> head = {""};
  for (std::size_t i = 0; i < compared.size(); ++i) head.push_back(key_of(i, *compared[i].run));
  std::vector<std::vector<std::string>> rows;
  const auto add = [&](const std::vector<ComparedFigure>& figures) {
    for (const ComparedFigure& figure : figures) {
      std::vector<std::string>& row = rows.emplace_back(1, figure.name);
      for (const ComparedRun& one : compared) row.push_back(figure.value(one));
    }
  };
  add(figures_of_frames());
  if (has_truth) add(figures_of_error());
  add(figures_of_map());
  return table_of(head, rows);
}

std::string draw_all(const std::vector<ComparedRun>& compared, const TruePath* truth) {
  PathDrawing drawing;
  drawing.unit = truth ? "m" : length_unit(*compared.front().run);
  drawing.title = "The paths of all runs";
  std::vector<StampedPose> upright;
  if (truth) drawing.paths.push_back(path_of(truth->poses, Sim3(), "class=\"truth\""));
  for (std::size_t i = 0; i < compared.size(); ++i) {
    const ComparedRun& one = compared[i];
    const std::vector<StampedPose>& poses = one.run->trajectories.front();
    drawing.paths.push_back(path_of(poses, one.shown_from_world, style_of(i)));
    if (!upright.empty()) continue;
    for (const StampedPose& pose : poses) {
      upright.push_back(
          {pose.timestamp_ns, aligned_pose(one.shown_from_world, pose.world_from_camera)});
    }
  }
  const auto views = choose_views(upright);
  std::string html = "<div class=\"side-by-side\">\n<figure><figcaption>From above</figcaption>\n" +
                     draw_paths(drawing, views[0]) +
                     "</figure>\n<figure><figcaption>From the side</figcaption>\n" +
                     draw_paths(drawing, views[1]) + "</figure>\n</div>\n<p>";
  for (std::size_t i = 0; i < compared.size(); ++i) html += key_of(i, *compared[i].run) + " ";
  html += "</p>\n";
  for (const ComparedRun& one : compared) {
    if (!one.note.empty()) html += "<p class=\"note\">" + escaped(one.note) + "</p>\n";
  }
  if (truth)
    html += "<p class=\"note\">Grey: the ground truth, " + escaped(truth->name) + ".</p>\n";
  return html;
}

}  // namespace

std::string format_run_comparison(std::span<const RunFolder> runs, const TruePath* truth) {
  WAYMARK_CHECK(runs.size() > 1);
  const std::vector<ComparedRun> compared = compare(runs, truth);
  std::string names;
  for (const RunFolder& run : runs) names += (names.empty() ? "" : ", ") + run.name;
  const std::string body =
      fmt::format(
          "<h1>{} runs compared</h1>\n<p class=\"lead\">{}</p>\n", runs.size(), escaped(names)) +
      section("Figures", figure_table(compared, truth != nullptr)) +
      section("Paths", draw_all(compared, truth));
  return format_page("Waymark: runs compared", body);
}

}  // namespace waymark

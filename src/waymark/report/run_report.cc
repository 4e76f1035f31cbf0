// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/evaluate/association.h"
#include "waymark/report/advice.h"
#include "waymark/report/assessment.h"
#include "waymark/report/documentation.h"
#include "waymark/report/drawing.h"
#include "waymark/report/evaluate_files.h"
#include "waymark/report/imu_section.h"
#include "waymark/report/page.h"
#include "waymark/report/report.h"
#include "waymark/report/timeline.h"

namespace waymark {
namespace {

/// The map is drawn as far around the path, in its extents: a path in a room is shorter than it.
constexpr double kMapMargin = 20.0;
/// A longer time between compared poses is a gap, in usual times.
constexpr double kErrorGapIntervals = 5.0;

std::string paragraph(std::string_view style, std::string_view text) {
  return fmt::format("<p class=\"{}\">{}</p>\n", style, escaped(text));
}

std::string head_of(const RunFolder& run, const Assessment& verdict) {
  const FrameCounts& counts = run.summary.counts;
  std::string why = "All that is judged is good.";
  if (verdict.grade != Grade::kGood) {
    const std::string bad = verdict.names_of(Grade::kBad);
    const std::string check = verdict.names_of(Grade::kCheck);
    why = bad.empty() ? "" : "Bad: " + bad + ". ";
    if (!check.empty()) why += "To check: " + check + ".";
  }
  return fmt::format(
             "<h1>{} {}</h1>\n<p>{}</p>\n", escaped(run.name), badge(verdict.grade), escaped(why)) +
         paragraph("lead",
                   fmt::format("{} of {} frames have a pose; {}, {}, {}; {}",
                               counts.tracked,
                               counts.frames,
                               count_of(run.summary.keyframes, "keyframe"),
                               count_of(run.summary.landmarks, "landmark"),
                               count_of(run.summary.loops, "loop"),
                               run.summary.setup));
}

std::string quality_section(const Assessment& verdict) {
  std::vector<std::vector<std::string>> rows;
  for (const Judgement& judgement : verdict.judgements) {
    rows.push_back({escaped(judgement.name),
                    badge(judgement.grade),
                    escaped(judgement.value),
                    escaped(judgement.why)});
  }
  return section("Quality", table_of({"What", "Grade", "Value", "Why"}, rows, "stack"));
}

std::string advice_section(const RunFolder& run) {
  std::string body;
  for (const std::string& mistake : run.summary.mistakes.value_or(std::vector<std::string>())) {
    body += "<div class=\"tip\">" + paragraph("", mistake) +
            paragraph("note", documentation("docs/troubleshooting.md#a-warning-names-a-mistake")) +
            "</div>\n";
  }
  for (const RunAdvice& advice : advise(run.table, run.summary)) {
    body += fmt::format("<div class=\"tip\"><h3>{}</h3>\n<p>Try: {}.</p>\n{}</div>\n",
                        escaped(advice.seen),
                        escaped(advice.remedy),
                        paragraph("note", documentation(advice.see)));
  }
  return body.empty() ? "" : section("What to try", body);
}

/// Where camera 0 was at a frame of the input, in the first part of the map.
class FramePlaces {
 public:
  explicit FramePlaces(const RunFolder& run) : poses_(run.trajectories.front()) {
    for (const FrameRecord& frame : run.table.frames) times_[frame.index] = frame.timestamp_ns;
  }
  const StampedPose* at_index(std::uint32_t index) const {
    const auto time = times_.find(index);
    return time == times_.end() ? nullptr : at_time(time->second);
  }
  const StampedPose* at_time(std::int64_t timestamp_ns) const {
    const auto found =
        std::ranges::lower_bound(poses_, timestamp_ns, {}, &StampedPose::timestamp_ns);
    return found == poses_.end() || found->timestamp_ns != timestamp_ns ? nullptr : &*found;
  }

 private:
  const std::vector<StampedPose>& poses_;
  std::map<std::uint32_t, std::int64_t> times_;
};

std::vector<DrawnMark> marks_of(const RunFolder& run, const Sim3& drawn_from_world) {
  std::vector<DrawnMark> marks;
  const FramePlaces places(run);
  const auto add = [&](const StampedPose* pose, const char* style) {
    if (pose) marks.push_back({drawn_from_world * pose->world_from_camera.translation, style});
  };
  for (const LoopFrames& loop : run.summary.loop_frames) {
    if (loop.to) add(places.at_index(*loop.to), "class=\"loop\"");
  }
  for (const FrameRecord& frame : run.table.frames) {
    if (frame.is_relocalized) add(places.at_time(frame.timestamp_ns), "class=\"again\"");
  }
  add(&run.trajectories.front().front(), "class=\"start\"");
  return marks;
}

std::string path_section(const RunFolder& run, const Evaluation* compared, const TruePath* truth) {
  const std::vector<StampedPose>& poses = run.trajectories.front();
  if (poses.empty())
    return section("Path", paragraph("", "No frame got a pose: there is no path."));
  PathDrawing drawing;
  const Sim3 shown = compared ? compared->groundtruth_from_estimate : Sim3();
  drawing.unit = compared ? "m" : length_unit(run);
  std::vector<StampedPose> upright;
  for (const StampedPose& pose : poses) {
    upright.push_back({pose.timestamp_ns, aligned_pose(shown, pose.world_from_camera)});
  }
  for (const Eigen::Vector3f& point : run.points) {
    drawing.points.push_back((shown * point.cast<double>()).cast<float>());
  }
  if (compared) drawing.paths.push_back(path_of(truth->poses, Sim3(), "class=\"truth\""));
  drawing.paths.push_back(path_of(poses, shown, "class=\"path0\""));
  drawing.marks = marks_of(run, shown);
  const auto views = choose_views(upright);
  PathDrawing map = drawing;
  map.cloud_margin = kMapMargin;
  map.title = "The map from above";
  PathDrawing side = drawing;
  side.title = "The path from the side";
  drawing.title = "The path from above";
  const auto figure = [](std::string_view caption, const std::string& svg) {
    return fmt::format("<figure><figcaption>{}</figcaption>\n{}</figure>\n", caption, svg);
  };
  std::string body = "<div class=\"side-by-side\">\n" +
                     figure("From above", draw_paths(drawing, views[0])) +
                     figure("From the side", draw_paths(side, views[1])) +
                     figure("The map from above", draw_paths(map, views[0])) + "</div>\n";
  body += paragraph(
      "note",
      fmt::format("Blue: camera 0, from the ring on.{} Violet dots: places seen again. Orange "
                  "dots: found again after a loss. Points: {} of the map's landmarks.",
                  compared ? " Grey: the ground truth." : "",
                  run.points.size()));
  if (run.trajectories.size() > 1) {
    body += paragraph("note",
                      fmt::format("Not drawn: {} of the map with a world of its own.",
                                  count_of(run.trajectories.size() - 1, "other part")));
  }
  return section("Path", body);
}

std::string truth_section(const Evaluation& compared, const TruePath& truth, const RunFolder& run) {
  DrawnCurve over_time{{}, {}, {}, "time [s]", "Position error over time"};
  DrawnCurve over_path{{}, {}, {}, "path [m]", "Position error over the path"};
  const double max_gap_ns =
      kErrorGapIntervals * static_cast<double>(median_interval_ns(run.trajectories.front()));
  const FramePlaces places(run);
  double travelled_m = 0.0;
  const StampedPose* last = nullptr;
  for (const PositionError& error : compared.errors) {
    const StampedPose* pose = places.at_time(error.timestamp_ns);
    if (pose && last) {
      const Eigen::Vector3d step =
          pose->world_from_camera.translation - last->world_from_camera.translation;
      travelled_m += compared.groundtruth_from_estimate.scale * step.norm();
    }
    const bool is_after_gap =
        pose && last && static_cast<double>(pose->timestamp_ns - last->timestamp_ns) > max_gap_ns;
    over_time.starts_stroke.push_back(is_after_gap);
    over_path.starts_stroke.push_back(is_after_gap);
    if (pose) last = pose;
    over_time.x.push_back(1e-9 * (static_cast<double>(error.timestamp_ns) -
                                  static_cast<double>(compared.errors.front().timestamp_ns)));
    over_path.x.push_back(travelled_m);
    over_time.y.push_back(error.error_m);
    over_path.y.push_back(error.error_m);
  }
  std::string body = table_of(
      {},
      {{"ATE",
        fmt::format("{:.4g} m root mean square, {:.4g} m median, {:.4g} m at most",
                    compared.ate_m.rmse,
                    compared.ate_m.median,
                    compared.ate_m.max)},
       {"Of the path",
        compared.ate_percent
            ? fmt::format("{:.2g} % of {:.4g} m", *compared.ate_percent, compared.path_length_m)
            : "the path has no length"},
       {"RPE",
        fmt::format(
            "{:.3g} m and {:.3g} degrees from frame to frame", compared.rpe_m, compared.rpe_deg)},
       {"Laid over it",
        fmt::format("{}, scale {:.5g}, {} of {} poses compared",
                    to_string(compared.alignment),
                    compared.groundtruth_from_estimate.scale,
                    compared.num_pairs,
                    compared.num_estimate_poses)},
       {"Ground truth", escaped(truth.name)}});
  body +=
      "<div class=\"side-by-side\">\n<figure><figcaption>Position error [m] over "
      "time</figcaption>\n" +
      draw_curve(over_time) +
      "</figure>\n<figure><figcaption>Position error [m] over the path</figcaption>\n" +
      draw_curve(over_path) + "</figure>\n</div>\n";
  return section("Ground truth", body);
}

std::string coverage_section(const RunFolder& run) {
  std::map<FrameState, std::size_t> states;
  std::map<FrameReason, std::size_t> reasons;
  for (const FrameRecord& frame : run.table.frames) {
    ++states[frame.state];
    if (frame.reason != FrameReason::kNone) ++reasons[frame.reason];
  }
  const double num_frames = static_cast<double>(std::max<std::size_t>(run.table.frames.size(), 1));
  std::vector<std::vector<std::string>> rows;
  const auto add = [&](std::string_view kind, std::string_view name, std::size_t count) {
    rows.push_back({std::string(kind),
                    std::string(name),
                    fmt::format("{}", count),
                    fmt::format("{:.1f} %", 100.0 * static_cast<double>(count) / num_frames)});
  };
  for (const auto& [state, count] : states) add("state", to_string(state), count);
  for (const auto& [reason, count] : reasons) add("no pose because", to_string(reason), count);
  std::string body = table_of({"", "", "Frames", "Part"}, rows, "times");
  const RunSummary& summary = run.summary;
  if (summary.out_of_order + summary.without_partner > 0) {
    body += paragraph("note",
                      fmt::format("Out of order and left out: {}. Without a partner: {}.",
                                  count_of(summary.out_of_order, "image"),
                                  summary.without_partner));
  }
  if (summary.missing_at_end > 0) {
    body += paragraph("note",
                      fmt::format("The video ended {} before its container says.",
                                  count_of(summary.missing_at_end, "frame")));
  }
  return section("Coverage and its reasons",
                 body + paragraph("note",
                                  documentation("docs/results.md") +
                                      " says what each state and reason means."));
}

std::string calibration_section(const RunSummary& summary) {
  std::string body;
  if (summary.calibration) {
    const EstimatedCalibrationSummary& found = *summary.calibration;
    body += paragraph(
        "",
        fmt::format("None was given. Estimated from the images: {}, focal length {:.1f} +- "
                    "{:.1f} px, {:.0f} degrees wide{}.",
                    found.model,
                    found.focal_px,
                    found.focal_sigma_px,
                    found.fov_deg,
                    found.is_sure ? "" : ", which the motion did not tell for sure"));
  }
  std::vector<std::vector<std::string>> rows;
  for (const CalibrationEstimate& estimate : summary.refined_calibration) {
    rows.push_back(
        {escaped(estimate.name),
         fmt::format("{:.6g} &plusmn; {:.2g}", estimate.given, estimate.given_sigma),
         fmt::format("{:.6g} &plusmn; {:.2g}", estimate.given + estimate.change, estimate.sigma),
         estimate.is_changed() ? "yes" : "no"});
  }
  if (rows.empty()) {
    body += paragraph("", summary.calibration ? "It stayed as estimated." : "It stayed as given.");
  } else {
    body += table_of({"Parameter (px, rad or 1)", "Before", "After", "Changed beyond doubt"}, rows);
  }
  return section("Calibration", body);
}

std::string time_section(const RunSummary& summary) {
  double largest_ms = 1e-6;
  for (const auto& [stage, times] : summary.stages_ms)
    largest_ms = std::max(largest_ms, times.mean);
  std::vector<std::vector<std::string>> rows;
  const auto add = [&](std::string_view name, const TimeStatistics& times, bool has_bar) {
    const double part = std::clamp(times.mean / largest_ms, 0.0, 1.0);
    rows.push_back(
        {escaped(name),
         fmt::format("{:.2f} ms", times.mean),
         fmt::format("{:.2f} ms", times.p95),
         has_bar
             ? fmt::format(
                   "<div class=\"bar-box\"><div class=\"bar\" style=\"width:{:.0f}%\"></div></div>",
                   100.0 * part)
             : ""});
  };
  for (const auto& [stage, times] : summary.stages_ms) add(stage, times, true);
  add("tracking, per frame", summary.tracking_ms, false);
  add("mapping, per keyframe", summary.mapping_ms, false);
  return section(
      "Time per stage",
      table_of({"Stage", "Mean", "95 % below", ""}, rows, "times") +
          paragraph(
              "note",
              fmt::format("{:.1f} s by the clock, {:.1f} s of all cores, {:.0f} MB of memory at "
                          "most",
                          summary.wall_s,
                          summary.cpu_s,
                          summary.peak_rss_mb)));
}

std::string settings_section(const RunSummary& summary) {
  std::string input, settings;
  for (const std::string& line : summary.input) input += escaped(line) + "<br>";
  for (const std::string& line : summary.settings)
    settings += "<code>" + escaped(line) + "</code><br>";
  return section("Input, settings, version",
                 table_of({},
                          {{"Input", input.empty() ? "not recorded" : input},
                           {"Settings", settings.empty() ? "all as by default" : settings},
                           {"Timing", escaped(summary.timing)},
                           {"Seed", fmt::format("{}", summary.seed)},
                           {"Version", "waymark " + escaped(summary.version)}}));
}

}  // namespace

std::string length_unit(const RunFolder& run) {
  return run.summary.quality && !run.summary.quality->is_metric ? "map units" : "m";
}

Evaluation evaluate_run(const RunFolder& run, const TruePath& truth) {
  EvaluationOptions options;
  options.alignment = truth.alignment.value_or(alignment_for(run.summary));
  options.num_frames = run.table.frames.size();
  return evaluate(run.trajectories.front(), truth.poses, options);
}

std::string format_report(const RunFolder& run, const TruePath* truth) {
  std::optional<Evaluation> compared;
  if (truth && !run.trajectories.front().empty()) compared = evaluate_run(run, *truth);
  const Evaluation* error = compared ? &*compared : nullptr;
  const Assessment verdict = judge(run.table, run.summary, error);
  std::string body = head_of(run, verdict);
  body += quality_section(verdict);
  body += advice_section(run);
  body += path_section(run, error, truth);
  body += section("Timeline", draw_timelines(run.table, run.summary));
  if (compared) body += truth_section(*compared, *truth, run);
  body += coverage_section(run);
  body += calibration_section(run.summary);
  body += imu_section(run);
  body += time_section(run.summary);
  body += settings_section(run.summary);
  return format_page("Waymark report: " + run.name, body);
}

}  // namespace waymark

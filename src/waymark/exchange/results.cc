// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numeric>

#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"

namespace waymark {
namespace {

using Json = nlohmann::ordered_json;

/// Figures with 4 decimals, which is plenty and keeps the files readable.
double rounded(double value) { return std::isfinite(value) ? std::round(value * 1e4) / 1e4 : 0.0; }

Json to_json(const TimeStatistics& times, bool has_max) {
  Json json = {{"mean", rounded(times.mean)},
               {"median", rounded(times.median)},
               {"p95", rounded(times.p95)}};
  if (has_max) json["max"] = rounded(times.max);
  return json;
}

Json to_json(const RunQuality& quality) {
  return {{"reprojection_px", rounded(quality.reprojection_px)},
          {"matches_kept", rounded(quality.matches_kept)},
          {"length", rounded(quality.length)},
          {"is_metric", quality.is_metric}};
}

Json to_json(const EstimatedCalibrationSummary& calibration) {
  return {{"source", "estimated"},
          {"model", calibration.model},
          {"focal_px", rounded(calibration.focal_px)},
          {"focal_sigma_px", rounded(calibration.focal_sigma_px)},
          {"fov_deg", rounded(calibration.fov_deg)},
          {"is_sure", calibration.is_sure}};
}

/// Numbers of a calibration keep their digits: distortion is small.
Json to_json(const std::vector<CalibrationEstimate>& calibration) {
  Json list = Json::array();
  for (const CalibrationEstimate& estimate : calibration) {
    list.push_back({{"name", estimate.name},
                    {"given", estimate.given},
                    {"given_sigma", estimate.given_sigma},
                    {"change", estimate.change},
                    {"sigma", estimate.sigma}});
  }
  return list;
}

Json to_json(const std::vector<LoopFrames>& loops) {
  const auto index = [](const std::optional<std::uint32_t>& frame) {
    return frame ? Json(*frame) : Json(nullptr);
  };
  Json list = Json::array();
  for (const LoopFrames& loop : loops) list.push_back({index(loop.from), index(loop.to)});
  return list;
}

Json to_json(const std::vector<ScaleSummary>& scales) {
  Json list = Json::array();
  for (const ScaleSummary& scale : scales) {
    list.push_back({{"submap", scale.submap},
                    {"same_as", scale.same_as},
                    {"sigma", rounded(scale.sigma)},
                    {"landmarks", scale.num_landmarks}});
  }
  return list;
}

Json to_json(const std::vector<RunAdvice>& advice) {
  Json list = Json::array();
  for (const RunAdvice& one : advice) {
    list.push_back(
        {{"cause", one.cause}, {"seen", one.seen}, {"remedy", one.remedy}, {"see", one.see}});
  }
  return list;
}

/// What is known of the image of a frame; empty fields where nothing is.
std::string picture_fields(const FrameRecord& frame) {
  std::string text = ",";
  if (frame.num_features) text += fmt::format("{}", *frame.num_features);
  const PictureFigures& picture = frame.picture;
  if (!picture.is_known) return text + ",,,";
  return text +
         fmt::format(",{},{},{}", picture.brightness, picture.contrast, picture.blur_percent);
}

void append_counts(Json& json, const FrameCounts& counts, std::size_t num_trajectory_lines) {
  json["frames"] = counts.frames;
  json["tracked"] = counts.tracked;
  json["filled"] = counts.filled;
  json["unreadable"] = counts.unreadable;
  json["dropped"] = counts.dropped;
  json["coverage"] =
      counts.frames == 0
          ? 0.0
          : rounded(static_cast<double>(num_trajectory_lines) / static_cast<double>(counts.frames));
  json["initialized_at"] = counts.initialized_at ? Json(*counts.initialized_at) : Json(nullptr);
  json["lost_count"] = counts.lost_count;
}

Json to_json(const MarkerSummary& summary) {
  Json json;
  json["family"] = summary.family;
  json["frame"] = summary.frame;
  json["scale_sigma"] = summary.scale_sigma;
  json["survey_rms_m"] = summary.survey_rms_m;
  json["used"] = std::ranges::count(summary.markers, "used", &MarkerSummary::Entry::verdict);
  Json markers = Json::array();
  for (const MarkerSummary::Entry& entry : summary.markers) {
    Json marker;
    marker["id"] = entry.id;
    marker["verdict"] = entry.verdict;
    marker["keyframes"] = entry.num_keyframes;
    marker["rms_px"] = rounded(entry.rms_px);
    if (!entry.fault.empty()) marker["fault"] = entry.fault;
    markers.push_back(marker);
  }
  json["markers"] = markers;
  return json;
}

}  // namespace

void FrameRecord::set_stages(std::span<const double> times_ms) {
  WAYMARK_CHECK(times_ms.size() <= kMaxStages);
  num_stages = static_cast<std::uint8_t>(times_ms.size());
  std::ranges::transform(
      times_ms, stage_ms.begin(), [](double ms) { return static_cast<Eigen::half>(ms); });
}

TimeStatistics summarize_times(std::vector<double> samples_ms) {
  if (samples_ms.empty()) return {};
  std::sort(samples_ms.begin(), samples_ms.end());
  const std::size_t n = samples_ms.size();
  const std::size_t rank95 = (95 * n + 99) / 100;  // ceil(0.95 n)
  TimeStatistics times;
  times.mean = std::accumulate(samples_ms.begin(), samples_ms.end(), 0.0) / static_cast<double>(n);
  times.median = 0.5 * (samples_ms[(n - 1) / 2] + samples_ms[n / 2]);
  times.p95 = samples_ms[rank95 - 1];
  times.max = samples_ms.back();
  return times;
}

FrameCounts count_frames(std::span<const FrameRecord> frames) {
  FrameCounts counts;
  counts.frames = frames.size();
  FrameState before = FrameState::kInitializing;
  for (const FrameRecord& frame : frames) {
    const bool is_filled = frame.state == FrameState::kFilled;
    const bool is_tracked = frame.state == FrameState::kTracked;
    counts.filled += is_filled ? 1 : 0;
    counts.tracked += is_filled || is_tracked ? 1 : 0;
    counts.unreadable += frame.state == FrameState::kUnreadable ? 1 : 0;
    counts.dropped += frame.state == FrameState::kDropped ? 1 : 0;
    if (is_tracked && !counts.initialized_at) counts.initialized_at = frame.index;
    // A frame without an image says nothing: lost, unreadable, lost is one loss.
    if (frame.state == FrameState::kUnreadable || frame.state == FrameState::kDropped) continue;
    if (frame.state == FrameState::kLost && before != FrameState::kLost) ++counts.lost_count;
    before = frame.state;
  }
  return counts;
}

std::vector<std::pair<std::string, TimeStatistics>> summarize_stages(const FrameTable& table) {
  std::vector<std::pair<std::string, TimeStatistics>> stages;
  for (std::size_t i = 0; i < table.stages.size(); ++i) {
    std::vector<double> samples_ms;
    for (const FrameRecord& frame : table.frames) {
      if (frame.num_stages > 0) samples_ms.push_back(static_cast<double>(frame.stage_ms.at(i)));
    }
    stages.emplace_back(table.stages[i], summarize_times(std::move(samples_ms)));
  }
  return stages;
}

std::string format_frames_csv(const FrameTable& table) {
  std::string text = "index,timestamp_ns,state,reason,matches,inliers,is_keyframe,submap";
  for (const std::string& stage : table.stages) text += fmt::format(",{}_ms", stage);
  text += ",features,brightness,contrast,blur,is_relocalized\n";
  for (const FrameRecord& frame : table.frames) {
    auto out = std::back_inserter(text);
    fmt::format_to(out,
                   "{},{},{},{},",
                   frame.index,
                   frame.timestamp_ns,
                   to_string(frame.state),
                   to_string(frame.reason));
    fmt::format_to(
        out, "{},{},{},", frame.num_matches, frame.num_inliers, frame.is_keyframe ? 1 : 0);
    if (frame.submap.is_valid()) fmt::format_to(out, "{}", frame.submap.value);
    WAYMARK_CHECK(frame.num_stages == 0 || frame.num_stages == table.stages.size());
    for (std::size_t i = 0; i < table.stages.size(); ++i) {
      fmt::format_to(
          out, ",{:.4f}", frame.num_stages == 0 ? 0.0 : static_cast<double>(frame.stage_ms[i]));
    }
    text += picture_fields(frame) + (frame.is_relocalized ? ",1\n" : ",0\n");
  }
  return text;
}

std::string format_summary_json(const RunSummary& summary) {
  Json json;
  append_counts(json, summary.counts, summary.num_trajectory_lines);
  json["out_of_order"] = summary.out_of_order;
  json["without_partner"] = summary.without_partner;
  json["missing_at_end"] = summary.missing_at_end;
  if (summary.localized) json["localized"] = *summary.localized;
  json["keyframes"] = summary.keyframes;
  json["landmarks"] = summary.landmarks;
  json["submaps"] = summary.submaps;
  json["loops"] = summary.loops;
  json["relocalizations"] = summary.relocalizations;
  json["loop_frames"] = to_json(summary.loop_frames);
  if (!summary.scales.empty()) json["scales"] = to_json(summary.scales);
  if (summary.quality) json["quality"] = to_json(*summary.quality);
  if (summary.moves_along) json["moves_along"] = *summary.moves_along;
  if (summary.mistakes) json["mistakes"] = *summary.mistakes;
  if (summary.markers) json["markers"] = to_json(*summary.markers);
  if (!summary.refined_calibration.empty()) {
    json["refined_calibration"] = to_json(summary.refined_calibration);
  }
  if (summary.calibration) json["calibration"] = to_json(*summary.calibration);
  json["wall_s"] = rounded(summary.wall_s);
  json["cpu_s"] = rounded(summary.cpu_s);
  json["peak_rss_mb"] = rounded(summary.peak_rss_mb);
  json["tracking_ms"] = to_json(summary.tracking_ms, true);
  json["mapping_ms"] = to_json(summary.mapping_ms, true);
  Json stages = Json::object();
  for (const auto& [name, times] : summary.stages_ms) stages[name] = to_json(times, false);
  json["stages_ms"] = stages;
  json["setup"] = summary.setup;
  json["timing"] = summary.timing;
  json["seed"] = summary.seed;
  json["version"] = summary.version;
  json["input"] = summary.input;
  json["settings"] = summary.settings;
  json["advice"] = to_json(summary.advice);
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string format_points_ply(std::span<const Eigen::Vector3f> points) {
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n",
      points.size());
  auto out = std::back_inserter(text);
  for (const Eigen::Vector3f& point : points) {
    fmt::format_to(out, "{:.5g} {:.5g} {:.5g}\n", point.x(), point.y(), point.z());
  }
  return text;
}

void write_frames_csv(const std::filesystem::path& folder, const FrameTable& table) {
  write_file_atomically(folder / "frames.csv", format_frames_csv(table));
}

void write_summary_json(const std::filesystem::path& folder, const RunSummary& summary) {
  write_file_atomically(folder / "summary.json", format_summary_json(summary));
}

void write_trajectories(const std::filesystem::path& folder,
                        std::span<const std::vector<StampedPose>> trajectories) {
  const auto path_of = [&folder](std::size_t i) {
    return folder / (i == 0 ? std::string("trajectory.txt") : fmt::format("trajectory_{}.txt", i));
  };
  write_trajectory(path_of(0),
                   trajectories.empty() ? std::vector<StampedPose>() : trajectories[0],
                   TrajectoryFormat::kTum);
  std::size_t i = 1;
  for (; i < trajectories.size(); ++i)
    write_trajectory(path_of(i), trajectories[i], TrajectoryFormat::kTum);
  std::error_code error;
  while (std::filesystem::remove(path_of(i), error)) ++i;
}

}  // namespace waymark

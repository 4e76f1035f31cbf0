// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/results/results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>

#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/geometry/rigid3.h"

namespace waymark {
namespace {

using Json = nlohmann::ordered_json;

/// What frames.csv and summary.json begin with.
constexpr std::string_view kFrameColumns =
    "index,timestamp_ns,state,reason,matches,inliers,is_keyframe,submap";
constexpr std::string_view kSummaryBegin = "{\n  \"frames\": ";

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
          {"reprojection_percent", rounded(quality.reprojection_percent)},
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
    list.push_back({{"submap", scale.submap}, {"same_as", scale.same_as}});
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
  const ImageStatistics& picture = frame.picture;
  if (!picture.is_known) return text + ",,,";
  return text +
         fmt::format(",{},{},{}", picture.brightness, picture.contrast, picture.blur_percent);
}

/// Quoted where it would be more than one field (RFC 4180).
std::string name_field(const std::string& name) {
  const std::string text = printable(name);
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string field = "\"";
  for (const char c : text) field += c == '"' ? "\"\"" : std::string(1, c);
  return field + "\"";
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

Json to_json(const Eigen::Vector3d& vector) {
  return {rounded(vector.x()), rounded(vector.y()), rounded(vector.z())};
}

Json with_sigma(const Json& value, double sigma) {
  return {{"value", value}, {"sigma", rounded(sigma)}};
}

Json to_json(const InertialReport& report) {
  Json json;
  json["used"] = report.is_used;
  if (!report.is_used) {
    json["reason"] = report.reason;
    return json;
  }
  constexpr double kDegrees = 180.0 / M_PI;
  const auto& [rotation, translation] = report.imu_from_rig;
  json["metric_from_frame"] = report.metric_from ? Json(report.metric_from->value) : Json(nullptr);
  json["scale_sigma"] = rounded(report.scale_sigma);
  json["gravity_in_world"] = to_json(report.gravity_in_world);
  json["gravity_sigma_deg"] = rounded(kDegrees * report.gravity_sigma_rad);
  json["time_shift_ms"] =
      with_sigma(rounded(1e3 * report.time_shift_s), 1e3 * report.time_shift_sigma_s);
  json["rotation_deg"] =
      with_sigma(to_json(kDegrees * so3_log(rotation)), kDegrees * report.rotation_sigma_rad);
  json["lever_arm_m"] = with_sigma(to_json(translation), report.lever_arm_sigma_m);
  json["gyro_bias"] = to_json(report.biases.gyroscope);
  json["accel_bias"] = to_json(report.biases.accelerometer);
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
  std::string text(kFrameColumns);
  for (const std::string& stage : table.stages) text += fmt::format(",{}_ms", stage);
  text += ",features,brightness,contrast,blur,is_relocalized";
  text += table.names.empty() ? "\n" : ",name\n";
  WAYMARK_CHECK(table.names.empty() || table.names.size() == table.frames.size());
  for (const FrameRecord& frame : table.frames) {
    auto out = std::back_inserter(text);
    fmt::format_to(out,
                   "{},{},{},{},",
                   frame.index,
                   table.has_times ? fmt::to_string(frame.timestamp_ns) : "",
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
    text += picture_fields(frame) + (frame.is_relocalized ? ",1" : ",0");
    const auto row = static_cast<std::size_t>(&frame - table.frames.data());
    text += table.names.empty() ? "\n" : fmt::format(",{}\n", name_field(table.names[row]));
  }
  return text;
}

std::string format_poses_csv(const FrameTable& table,
                             std::span<const std::vector<StampedPose>> trajectories) {
  std::map<std::int64_t, const StampedPose*> poses;
  for (const std::vector<StampedPose>& trajectory : trajectories) {
    for (const StampedPose& pose : trajectory) poses[pose.timestamp_ns] = &pose;
  }
  std::string text = "name,submap,tx,ty,tz,qx,qy,qz,qw\n";
  for (std::size_t i = 0; i < table.frames.size(); ++i) {
    const auto found = poses.find(table.frames[i].timestamp_ns);
    if (found == poses.end()) continue;
    const Rigid3& pose = found->second->world_from_camera;
    text += fmt::format("{},{}", name_field(table.names[i]), table.frames[i].submap.value);
    for (const double value : pose.translation) text += fmt::format(",{:.9g}", value);
    for (const double value : pose.rotation.coeffs()) text += fmt::format(",{:.9g}", value);
    text += "\n";
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
  if (summary.imu) json["imu"] = to_json(*summary.imu);
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

bool is_result_name(std::string_view name) {
  constexpr std::array<std::string_view, 10> kNames = {"trajectory.txt",
                                                       "poses.csv",
                                                       "keyframes.txt",
                                                       "points.ply",
                                                       "summary.json",
                                                       "frames.csv",
                                                       "inertial.csv",
                                                       "view_mask.png",
                                                       "calibration.yaml",
                                                       "report.html"};
  constexpr std::string_view kPart = "trajectory_", kSuffix = ".txt";
  if (name.starts_with(kPart) && name.ends_with(kSuffix)) {
    name.remove_prefix(kPart.size());
    name.remove_suffix(kSuffix.size());
    return !name.empty() && std::ranges::all_of(name, is_digit);
  }
  return std::ranges::find(kNames, name) != kNames.end();
}

bool holds_results(const std::filesystem::path& folder) {
  const auto begins = [&folder](const char* name, std::string_view with) {
    std::string begin(with.size(), '\0');
    std::ifstream(folder / name).read(begin.data(), static_cast<std::streamsize>(begin.size()));
    return begin == with;
  };
  return begins("summary.json", kSummaryBegin) || begins("frames.csv", kFrameColumns);
}

void write_frames_csv(const std::filesystem::path& folder, const FrameTable& table) {
  write_file_atomically(folder / "frames.csv", format_frames_csv(table));
}

void write_summary_json(const std::filesystem::path& folder, const RunSummary& summary) {
  write_file_atomically(folder / "summary.json", format_summary_json(summary));
}

void write_trajectories(const std::filesystem::path& folder,
                        std::span<const std::vector<StampedPose>> trajectories,
                        bool has_times) {
  const auto path_of = [&folder](std::size_t i) {
    return folder / (i == 0 ? std::string("trajectory.txt") : fmt::format("trajectory_{}.txt", i));
  };
  std::size_t i = 0;
  for (; has_times && i < std::max<std::size_t>(trajectories.size(), 1); ++i) {
    write_trajectory(path_of(i),
                     trajectories.empty() ? std::vector<StampedPose>() : trajectories[i],
                     TrajectoryFormat::kTum);
  }
  std::error_code error;
  while (std::filesystem::remove(path_of(i), error)) ++i;
}

}  // namespace waymark

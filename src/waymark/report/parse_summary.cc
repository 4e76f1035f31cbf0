// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "waymark/base/check.h"
#include "waymark/report/run_folder.h"

namespace waymark {
namespace {

using SummaryJson = nlohmann::ordered_json;

/// Counts beyond are no counts of frames or landmarks.
constexpr double kMaxCount = 1e15;

/// An object of a summary, whose keys may be missing but not of another kind.
class SummaryObject {
 public:
  SummaryObject(const SummaryJson& json, std::string where)
      : json_(json), where_(std::move(where)) {
    if (!json.is_object()) throw InputError(where_, "is no object, expected a JSON object");
  }

  void take(const char* key, double& value) const {
    const SummaryJson* found = find(key);
    if (!found) return;
    if (!found->is_number()) fail(key, "a number");
    value = found->get<double>();
  }
  void take(const char* key, std::size_t& value) const {
    double number = static_cast<double>(value);
    take(key, number);
    if (!(number >= 0.0 && number <= kMaxCount) || number != std::floor(number)) {
      fail(key, "a whole number that is not negative");
    }
    value = static_cast<std::size_t>(number);
  }
  void take(const char* key, bool& value) const {
    const SummaryJson* found = find(key);
    if (!found) return;
    if (!found->is_boolean()) fail(key, "true or false");
    value = found->get<bool>();
  }
  void take(const char* key, std::string& value) const {
    const SummaryJson* found = find(key);
    if (!found) return;
    if (!found->is_string()) fail(key, "a text");
    value = found->get<std::string>();
  }
  std::vector<std::string> texts(const char* key) const {
    std::vector<std::string> list;
    for (const SummaryJson& entry : array(key)) {
      if (!entry.is_string()) fail(key, "a list of texts");
      list.push_back(entry.get<std::string>());
    }
    return list;
  }
  /// The entries of a list; none where it is missing.
  const SummaryJson& array(const char* key) const {
    static const SummaryJson kNoEntries = SummaryJson::array();
    const SummaryJson* found = find(key);
    if (!found) return kNoEntries;
    if (!found->is_array()) fail(key, "a list");
    return *found;
  }
  std::optional<SummaryObject> object(const char* key) const {
    const SummaryJson* found = find(key);
    if (!found) return std::nullopt;
    return SummaryObject(*found, where_ + ": " + key);
  }
  /// The entry of a list as an object.
  SummaryObject entry(const char* key, const SummaryJson& json) const {
    return {json, where_ + ": " + key};
  }
  const SummaryJson& json() const { return json_; }
  [[noreturn]] void fail(const std::string& key, std::string_view expected) const {
    throw InputError(where_, fmt::format("'{}' is something else, expected {}", key, expected));
  }

 private:
  const SummaryJson* find(const char* key) const {
    const auto found = json_.find(key);
    return found == json_.end() || found->is_null() ? nullptr : &*found;
  }

  const SummaryJson& json_;
  std::string where_;
};

TimeStatistics parse_times_of(const std::optional<SummaryObject>& object) {
  TimeStatistics times;
  if (!object) return times;
  object->take("mean", times.mean);
  object->take("median", times.median);
  object->take("p95", times.p95);
  object->take("max", times.max);
  return times;
}

RunQuality parse_quality(const SummaryObject& object) {
  RunQuality quality;
  object.take("reprojection_px", quality.reprojection_px);
  object.take("reprojection_percent", quality.reprojection_percent);
  object.take("matches_kept", quality.matches_kept);
  object.take("length", quality.length);
  object.take("is_metric", quality.is_metric);
  return quality;
}

EstimatedCalibrationSummary parse_estimate(const SummaryObject& object) {
  EstimatedCalibrationSummary calibration;
  object.take("model", calibration.model);
  object.take("focal_px", calibration.focal_px);
  object.take("focal_sigma_px", calibration.focal_sigma_px);
  object.take("fov_deg", calibration.fov_deg);
  object.take("is_sure", calibration.is_sure);
  return calibration;
}

CalibrationEstimate parse_refinement(const SummaryObject& object) {
  CalibrationEstimate estimate;
  object.take("name", estimate.name);
  object.take("given", estimate.given);
  object.take("given_sigma", estimate.given_sigma);
  object.take("change", estimate.change);
  object.take("sigma", estimate.sigma);
  return estimate;
}

/// A value and its standard deviation, in other units.
void take_sigma(const SummaryObject& object, const char* key, double unit, double& sigma) {
  if (const auto part = object.object(key)) part->take("sigma", sigma);
  sigma *= unit;
}

InertialReport parse_imu(const SummaryObject& object) {
  constexpr double kDegree = M_PI / 180.0;
  InertialReport imu;
  object.take("used", imu.is_used);
  object.take("reason", imu.reason);
  object.take("scale_sigma", imu.scale_sigma);
  object.take("gravity_sigma_deg", imu.gravity_sigma_rad);
  imu.gravity_sigma_rad *= kDegree;
  std::size_t metric_from = 0;
  if (object.json().contains("metric_from_frame") &&
      !object.json()["metric_from_frame"].is_null()) {
    object.take("metric_from_frame", metric_from);
    imu.metric_from = FrameId{static_cast<std::uint32_t>(metric_from)};
  }
  if (const auto shift = object.object("time_shift_ms")) shift->take("value", imu.time_shift_s);
  imu.time_shift_s *= 1e-3;
  take_sigma(object, "time_shift_ms", 1e-3, imu.time_shift_sigma_s);
  take_sigma(object, "rotation_deg", kDegree, imu.rotation_sigma_rad);
  take_sigma(object, "lever_arm_m", 1.0, imu.lever_arm_sigma_m);
  return imu;
}

LoopFrames parse_loop(const SummaryObject& summary, const SummaryJson& json) {
  const auto index = [&](const SummaryJson& entry) -> std::optional<std::uint32_t> {
    if (entry.is_null()) return std::nullopt;
    if (!entry.is_number_unsigned() || entry.get<std::uint64_t>() > UINT32_MAX) {
      summary.fail("loop_frames", "pairs of frames");
    }
    return entry.get<std::uint32_t>();
  };
  if (!json.is_array() || json.size() != 2) summary.fail("loop_frames", "pairs of frames");
  return {index(json[0]), index(json[1])};
}

void parse_counts(const SummaryObject& object, RunSummary& summary) {
  object.take("out_of_order", summary.out_of_order);
  object.take("without_partner", summary.without_partner);
  object.take("missing_at_end", summary.missing_at_end);
  object.take("keyframes", summary.keyframes);
  object.take("landmarks", summary.landmarks);
  object.take("submaps", summary.submaps);
  object.take("loops", summary.loops);
  object.take("relocalizations", summary.relocalizations);
  object.take("wall_s", summary.wall_s);
  object.take("cpu_s", summary.cpu_s);
  object.take("peak_rss_mb", summary.peak_rss_mb);
  if (object.json().contains("localized")) {
    object.take("localized", summary.localized.emplace(0));
  }
  object.take("setup", summary.setup);
  object.take("timing", summary.timing);
  object.take("version", summary.version);
  std::size_t seed = 0;
  object.take("seed", seed);
  summary.seed = seed;
}

}  // namespace

RunSummary parse_summary_json(std::string_view text, const std::string& name) {
  SummaryJson json;
  try {
    json = SummaryJson::parse(text);
  } catch (const nlohmann::json::parse_error& error) {
    throw InputError(
        name, fmt::format("is no JSON at byte {}, expected the summary of a run", error.byte));
  }
  const SummaryObject object(json, name);
  RunSummary summary;
  parse_counts(object, summary);
  if (!json.contains("frames"))
    throw InputError(name, "has no 'frames', expected the summary of a run");
  if (const auto quality = object.object("quality")) summary.quality = parse_quality(*quality);
  if (json.contains("mistakes")) summary.mistakes = object.texts("mistakes");
  if (const auto found = object.object("calibration")) summary.calibration = parse_estimate(*found);
  for (const SummaryJson& entry : object.array("refined_calibration")) {
    summary.refined_calibration.push_back(
        parse_refinement(object.entry("refined_calibration", entry)));
  }
  for (const SummaryJson& entry : object.array("loop_frames")) {
    summary.loop_frames.push_back(parse_loop(object, entry));
  }
  if (const auto imu = object.object("imu")) summary.imu = parse_imu(*imu);
  summary.tracking_ms = parse_times_of(object.object("tracking_ms"));
  summary.mapping_ms = parse_times_of(object.object("mapping_ms"));
  if (const auto stages = object.object("stages_ms")) {
    for (const auto& [stage, times] : stages->json().items()) {
      summary.stages_ms.emplace_back(stage, parse_times_of(stages->entry(stage.c_str(), times)));
    }
  }
  summary.input = object.texts("input");
  summary.settings = object.texts("settings");
  return summary;
}

}  // namespace waymark

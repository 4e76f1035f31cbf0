// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/input_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "waymark/base/text.h"
#include "waymark/imu/imu_health.h"
#include "waymark/input/imu_stream.h"
#include "waymark/input/reading.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxGapsShown = 5;

double seconds(std::int64_t duration_ns) { return 1e-9 * static_cast<double>(duration_ns); }

double rate_of(const std::vector<std::int64_t>& times_ns) {
  return static_cast<double>(times_ns.size() - 1) / seconds(times_ns.back() - times_ns.front());
}

nlohmann::ordered_json cameras_as_json(const InputInfo& info) {
  auto cameras = nlohmann::ordered_json::array();
  const std::size_t count = info.setup == Setup::kStereo ? 2 : 1;
  for (std::size_t i = 0; i < count; ++i) {
    nlohmann::ordered_json camera;
    if (!info.calibration) {
      if (i == 0) camera = {{"width_px", info.width_px}, {"height_px", info.height_px}};
      camera["calibration"] = nullptr;
    } else {
      const CameraDescription& description = info.calibration->cameras.at(i).description;
      camera = {{"width_px", description.width_px},
                {"height_px", description.height_px},
                {"calibration",
                 {{"model", description.camera_model},
                  {"intrinsics", description.intrinsics},
                  {"distortion_model", description.distortion_model},
                  {"distortion_coeffs", description.distortion_coeffs}}}};
    }
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

nlohmann::ordered_json imu_as_json(const ImuStream& stream) {
  const ImuHealth health = imu_health(stream.samples);
  nlohmann::ordered_json json = {{"source", stream.source},
                                 {"samples", stream.samples.size()},
                                 {"rate_hz", health.rate_hz},
                                 {"duration_s", health.duration_s},
                                 {"mean_acceleration", health.accelerometer.mean_length},
                                 {"mean_angular_speed", health.gyroscope.mean_length},
                                 {"rest_s", health.rest_s},
                                 {"gyroscope_noise", nullptr},
                                 {"accelerometer_noise", nullptr},
                                 {"out_of_order", stream.num_out_of_order},
                                 {"doubles", stream.num_doubles},
                                 {"notes", stream.notes}};
  if (health.noise) {
    json["gyroscope_noise"] = health.noise->gyroscope;
    json["accelerometer_noise"] = health.noise->accelerometer;
  }
  json["gaps"] = nlohmann::ordered_json::array();
  for (const ImuGap& gap : health.gaps) {
    json["gaps"].push_back(
        {{"start_s", seconds(gap.start_ns)}, {"duration_s", seconds(gap.duration_ns)}});
  }
  return json;
}

std::string format_camera(const CameraDescription& camera, std::size_t index) {
  std::string numbers;
  for (const double value : camera.intrinsics)
    numbers += fmt::format("{}{:.6g}", numbers.empty() ? "" : ", ", value);
  std::string text = fmt::format("camera {}: {}x{} px, {} [{}]",
                                 index,
                                 camera.width_px,
                                 camera.height_px,
                                 camera.camera_model,
                                 numbers);
  if (camera.distortion_model == "none") return text + "\n";
  std::string coeffs;
  for (const double value : camera.distortion_coeffs)
    coeffs += fmt::format("{}{:.6g}", coeffs.empty() ? "" : ", ", value);
  return text + fmt::format(", {} [{}]\n", camera.distortion_model, coeffs);
}

std::string format_gaps(const std::vector<std::int64_t>& times_ns) {
  const std::vector<InputGap> gaps = find_gaps(times_ns);
  if (times_ns.size() < 2) return "";
  if (gaps.empty()) return "gaps: none\n";
  std::string text = fmt::format("gaps: {}\n", gaps.size());
  for (std::size_t i = 0; i < std::min(gaps.size(), kMaxGapsShown); ++i) {
    text += fmt::format("  {:.3f} s after frame {}, at {} s\n",
                        seconds(gaps[i].duration_ns),
                        gaps[i].index,
                        format_seconds(gaps[i].start_ns));
  }
  if (gaps.size() > kMaxGapsShown) text += "  ...\n";
  return text;
}

}  // namespace

std::vector<InputGap> find_gaps(const std::vector<std::int64_t>& times_ns) {
  const std::int64_t usual_ns = median_step_ns(times_ns);
  std::vector<InputGap> gaps;
  for (std::size_t i = 1; i < times_ns.size(); ++i) {
    const std::int64_t step_ns = times_ns[i] - times_ns[i - 1];
    if (step_ns > usual_ns + usual_ns / 2) gaps.push_back({i - 1, times_ns[i - 1], step_ns});
  }
  return gaps;
}

std::string format_input(const InputInfo& info) {
  std::string text;
  for (const std::string& line : info.lines) text += line + "\n";
  for (std::size_t i = 0; info.calibration && i < info.calibration->cameras.size(); ++i) {
    text += format_camera(info.calibration->cameras[i].description, i);
  }
  text += format_gaps(info.times_ns);
  if (info.imu) text += format_imu(*info.imu, info.times_ns);
  if (info.topics.empty()) return text;
  text += "topics:\n";
  for (const TopicInfo& topic : info.topics) {
    text += fmt::format("  {}: {}, {} messages{}\n",
                        topic.name,
                        topic.type,
                        topic.num_messages,
                        topic.is_used ? ", used" : "");
  }
  return text;
}

std::string format_input_json(const InputInfo& info) {
  nlohmann::ordered_json json;
  json["format"] = info.format;
  json["setup"] = std::string(to_string(info.setup));
  json["frames"] =
      info.num_frames ? nlohmann::ordered_json(*info.num_frames) : nlohmann::ordered_json(nullptr);
  const bool has_times = info.times_ns.size() > 1;
  json["rate_hz"] = nullptr;
  json["duration_s"] = nullptr;
  if (has_times) {
    json["rate_hz"] = rate_of(info.times_ns);
    json["duration_s"] = seconds(info.times_ns.back() - info.times_ns.front());
  }
  json["cameras"] = cameras_as_json(info);
  json["gaps"] = nlohmann::ordered_json::array();
  for (const InputGap& gap : find_gaps(info.times_ns)) {
    json["gaps"].push_back({{"after_frame", gap.index},
                            {"start_s", seconds(gap.start_ns)},
                            {"duration_s", seconds(gap.duration_ns)}});
  }
  json["out_of_order"] = info.counts.out_of_order;
  json["without_partner"] = info.counts.without_partner;
  json["imu"] = info.imu ? imu_as_json(*info.imu) : nlohmann::ordered_json(nullptr);
  json["topics"] = nlohmann::ordered_json::array();
  for (const TopicInfo& topic : info.topics) {
    json["topics"].push_back({{"name", topic.name},
                              {"type", topic.type},
                              {"messages", topic.num_messages},
                              {"is_used", topic.is_used}});
  }
  json["lines"] = info.lines;
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace waymark

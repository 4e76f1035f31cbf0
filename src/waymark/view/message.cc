// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/message.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace waymark {
namespace {

using nlohmann::json;

constexpr std::array<const char*, 6> kPhases = {
    "starting", "running", "paused", "finishing", "done", "map"};
constexpr std::size_t kNumStates = static_cast<std::size_t>(FrameState::kDropped) + 1;
constexpr std::size_t kNumReasons = static_cast<std::size_t>(FrameReason::kLate) + 1;

/// Text that is not UTF-8 (a file name may be anything) must not stop us.
std::string dump(const json& object) {
  return object.dump(-1, ' ', false, json::error_handler_t::replace);
}

template <class AnyId>
json id_or_null(AnyId id) {
  return id.is_valid() ? json(id.value) : json(nullptr);
}

json array_of(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

template <class Enum>
json names(std::size_t count) {
  json list = json::array();
  for (std::size_t i = 0; i < count; ++i) list.push_back(to_string(static_cast<Enum>(i)));
  return list;
}

double rounded(double value) { return std::round(1e3 * value) / 1e3; }

/// Numbers keep their digits: distortion is small.
json array_of(const std::vector<CalibrationEstimate>& calibration) {
  json list = json::array();
  for (const CalibrationEstimate& estimate : calibration) {
    list.push_back({{"name", estimate.name},
                    {"given", estimate.given},
                    {"change", estimate.change},
                    {"sigma", estimate.sigma}});
  }
  return list;
}

json describe(const ImuStatus& imu) {
  return {{"rate_hz", imu.rate_hz ? json(rounded(*imu.rate_hz)) : json(nullptr)},
          {"is_used", imu.is_used},
          {"reason", imu.reason},
          {"submap", id_or_null(imu.submap)},
          {"metric_submap", id_or_null(imu.metric_submap)},
          {"gravity", imu.gravity ? array_of(*imu.gravity) : json(nullptr)},
          {"velocity_m_s", imu.velocity_m_s ? array_of(*imu.velocity_m_s) : json(nullptr)}};
}

/// Distance of a feature from where its landmark should be seen.
double error_px(const Keyframe& keyframe, std::uint32_t feature, const Landmark& landmark) {
  const Features& features = *keyframe.features;
  const RigCamera& camera = keyframe.rig().cameras.at(features.keypoints[feature].camera);
  const Eigen::Vector3d point =
      camera.cam_from_rig * (keyframe.rig_from_world * landmark.position_in_world);
  const Eigen::Vector3f difference = point.normalized().cast<float>() - features.bearings[feature];
  return (features.level_pixel_from_bearing[feature] * difference).norm();
}

json describe_observation(const Map& map,
                          const Observation& observation,
                          const Landmark& landmark) {
  const Keyframe& keyframe = map.keyframes().at(observation.keyframe);
  const Keypoint& keypoint = keyframe.features->keypoints.at(observation.feature);
  return {{"keyframe", observation.keyframe.value},
          {"pixel", {rounded(keypoint.x_px), rounded(keypoint.y_px)}},
          {"camera", keypoint.camera},
          {"error_px", rounded(error_px(keyframe, observation.feature, landmark))}};
}

std::string describe_camera(const Rig& rig) {
  const Camera& camera = *rig.cameras.at(0).camera;
  return fmt::format("{}, {}x{} px{}",
                     camera.model(),
                     camera.width_px(),
                     camera.height_px(),
                     rig.cameras.size() > 1 ? fmt::format(", {} cameras", rig.cameras.size()) : "");
}

using Content = decltype(ClientRequest::content);

constexpr double kMaxRateHz = 20.0;
constexpr std::uint64_t kMaxNumber = std::uint64_t{1} << 53;

std::optional<std::uint64_t> read_number(const json& object, const char* key, std::uint64_t end) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number_unsigned()) return std::nullopt;
  const auto number = found->get<std::uint64_t>();
  if (number >= end) return std::nullopt;
  return number;
}

template <class AnyId>
Content read_id(const json& object) {
  const auto id = read_number(object, "id", UINT32_MAX);
  if (!id) return std::string("id: expected a number of 32 bits");
  return AnyId{static_cast<std::uint32_t>(*id)};
}

Content read_mapping(const json& object) {
  const auto on = object.find("on");
  if (on == object.end() || !on->is_boolean()) return std::string("on: expected true or false");
  return on->get<bool>() ? ViewRequest::Kind::kMappingOn : ViewRequest::Kind::kMappingOff;
}

Content read_rate(const json& object) {
  const auto hz = object.find("hz");
  if (hz == object.end() || !hz->is_number()) return std::string("hz: expected a number");
  const double value = hz->get<double>();
  if (!(value >= 0.0 && value <= kMaxRateHz)) return std::string("hz: expected 0 to 20");
  return SetRate{value};
}

/// {"keyframe": 7} or {"landmark": 7}.
std::optional<MapPlace> read_place(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_object() || found->size() != 1) return std::nullopt;
  const auto keyframe = read_number(*found, "keyframe", UINT32_MAX);
  if (keyframe) return KeyframeId{static_cast<std::uint32_t>(*keyframe)};
  const auto landmark = read_number(*found, "landmark", UINT32_MAX);
  if (landmark) return LandmarkId{static_cast<std::uint32_t>(*landmark)};
  return std::nullopt;
}

Content read_distance(const json& object) {
  const auto a = read_place(object, "a");
  const auto b = read_place(object, "b");
  if (!a || !b) return std::string("a, b: expected {\"keyframe\": ID} or {\"landmark\": ID}");
  const auto metres = object.find("metres");
  if (metres == object.end() || !metres->is_number()) {
    return std::string("metres: expected a number");
  }
  return KnownDistance{*a, *b, metres->get<double>()};
}

Content read_content(const json& object) {
  const auto found = object.find("do");
  if (found == object.end() || !found->is_string()) return std::string("do: expected a string");
  const auto name = found->get<std::string>();
  if (name == "pause") return ViewRequest::Kind::kPause;
  if (name == "resume") return ViewRequest::Kind::kResume;
  if (name == "reset") return ViewRequest::Kind::kReset;
  if (name == "save") return ViewRequest::Kind::kSave;
  if (name == "stop") return ViewRequest::Kind::kStop;
  if (name == "mapping") return read_mapping(object);
  if (name == "keyframe") return read_id<KeyframeId>(object);
  if (name == "landmark") return read_id<LandmarkId>(object);
  if (name == "rate") return read_rate(object);
  if (name == "scale") return read_distance(object);
  if (name == "image") {
    const Content id = read_id<KeyframeId>(object);
    const auto* keyframe = std::get_if<KeyframeId>(&id);
    return keyframe ? Content(GetImage{*keyframe}) : id;
  }
  return std::string("do: not known");
}

/// Whether brackets may nest so deeply that a parser runs out of stack; no request has many.
bool has_many_brackets(std::string_view text) {
  constexpr std::ptrdiff_t kMany = 16;
  return std::ranges::count_if(text, [](char c) { return c == '[' || c == '{'; }) > kMany;
}

}  // namespace

MessageWriter::MessageWriter(MessageKind kind, std::size_t num_elements) {
  add(static_cast<std::uint8_t>(kind));
  add(kProtocolVersion);
  add(std::uint16_t{0});
  add(static_cast<std::uint32_t>(num_elements));
}

void MessageWriter::add(const Eigen::Vector3d& vector) {
  for (int i = 0; i < 3; ++i) add(static_cast<float>(vector[i]));
}

void MessageWriter::add(const Eigen::Quaterniond& rotation) {
  for (int i = 0; i < 4; ++i) add(static_cast<float>(rotation.coeffs()[i]));
}

void MessageWriter::pad_to(std::size_t multiple) {
  bytes_.append((multiple - bytes_.size() % multiple) % multiple, '\0');
}

std::uint16_t saturate16(std::size_t value) {
  return static_cast<std::uint16_t>(std::min<std::size_t>(value, UINT16_MAX));
}

Message encode_ids(MessageKind kind, std::span<const std::uint32_t> ids) {
  MessageWriter writer(kind, ids.size());
  for (const std::uint32_t id : ids) writer.add(id);
  return writer.finish();
}

std::string format_hello(const SessionInfo& info) {
  json controls = json::array();
  if (info.is_live) controls = {"pause", "resume", "reset", "mapping", "stop"};
  if (info.can_save) controls.push_back("save");
  if (info.can_scale) controls.push_back("scale");
  json stages = json::array();
  for (const char* name : kStageNames) stages.push_back(name);
  return dump({{"type", "hello"},
               {"protocol", kProtocolVersion},
               {"program", info.program},
               {"mode", info.is_live ? "live" : "map"},
               {"input", info.input},
               {"setup", info.setup},
               {"timing", info.timing},
               {"controls", controls},
               {"keyframe_images", info.keeps_images},
               {"stages", stages},
               {"states", names<FrameState>(kNumStates)},
               {"reasons", names<FrameReason>(kNumReasons)}});
}

std::string format_status(const SessionStatus& status, const Map& map, std::size_t num_clients) {
  json stages = json::array();
  for (const double ms : status.stages.ms) stages.push_back(rounded(ms));
  std::size_t num_submaps = 0;
  for (const Submap& submap : map.submaps()) num_submaps += !submap.joined_into.is_valid();
  json object = {
      {"type", "status"},
      {"phase", kPhases.at(static_cast<std::size_t>(status.phase))},
      {"doing", status.doing},
      {"is_mapping", status.is_mapping},
      {"frame", status.frame ? json(status.frame->value) : json(nullptr)},
      {"time_s", rounded(status.time_s)},
      {"state", to_string(status.newest.state)},
      {"reason", to_string(status.newest.reason)},
      {"submap", id_or_null(status.newest.submap)},
      {"matches", status.newest.num_matches},
      {"inliers", status.newest.num_inliers},
      {"stages_ms", stages},
      {"tracking_ms", rounded(status.stages.tracking_ms())},
      {"tracking_ms_median", rounded(status.median_tracking_ms)},
      {"frames", status.num_frames},
      {"frames_total", status.num_frames_total ? json(*status.num_frames_total) : json(nullptr)},
      {"tracked", status.num_tracked},
      {"unreadable", status.num_unreadable},
      {"dropped", status.num_dropped},
      {"lost_count", status.lost_count},
      {"keyframes", map.keyframes().size()},
      {"landmarks", map.landmarks().size()},
      {"submaps", num_submaps},
      {"loops", map.measured_loop_edges().size()},
      {"frames_per_s", rounded(status.frames_per_s)},
      {"calibration", array_of(status.calibration)},
      {"clients", num_clients}};
  if (status.imu) object["imu"] = describe(*status.imu);
  return dump(object);
}

std::string format_reply(std::optional<std::uint64_t> number,
                         std::string_view error,
                         std::string_view path) {
  json reply = {{"type", "reply"},
                {"request", number ? json(*number) : json(nullptr)},
                {"ok", error.empty()}};
  if (!error.empty()) {
    reply["error"] = error;
  } else if (!path.empty()) {
    reply["path"] = path;
  }
  return dump(reply);
}

std::string format_keyframe(const Map& map, KeyframeId id, std::uint64_t number) {
  const Keyframe* keyframe = map.keyframes().find(id);
  if (!keyframe) return format_reply(number, "no such keyframe");
  const Rigid3 world_from_rig = keyframe->rig_from_world.inverse();
  const Eigen::Vector4d rotation = world_from_rig.rotation.coeffs();
  json covisible = json::array();
  for (const CovisibilityEdge& edge : map.covisible(id)) {
    covisible.push_back({edge.keyframe.value, edge.num_shared});
  }
  json landmarks = json::array();
  for (const LandmarkId landmark : keyframe->landmarks) {
    if (landmark.is_valid()) landmarks.push_back(landmark.value);
  }
  return dump({{"type", "keyframe"},
               {"request", number},
               {"id", id.value},
               {"frame", keyframe->frame.value},
               {"timestamp_ns", std::to_string(keyframe->timestamp_ns)},
               {"submap", keyframe->submap.value},
               {"position", array_of(world_from_rig.translation)},
               {"rotation", {rotation[0], rotation[1], rotation[2], rotation[3]}},
               {"parent", id_or_null(keyframe->parent)},
               {"features", keyframe->features->num_primary},
               {"camera", describe_camera(keyframe->rig())},
               {"covisible", covisible},
               {"landmarks", landmarks}});
}

Message encode_keyframe_image(const Keyframe& keyframe,
                              KeyframeId id,
                              std::uint64_t number,
                              std::string_view jpeg) {
  const Features& features = *keyframe.features;
  const Camera& camera = *keyframe.rig().cameras.at(0).camera;
  const auto num_features = static_cast<std::uint32_t>(features.num_primary);
  MessageWriter writer(MessageKind::kKeyframeImage, num_features);
  writer.add(static_cast<std::uint32_t>(number));
  writer.add(static_cast<std::uint32_t>(number >> 32));
  writer.add(id.value);
  writer.add(static_cast<std::uint32_t>(camera.width_px()));
  writer.add(static_cast<std::uint32_t>(camera.height_px()));
  writer.add(static_cast<std::uint32_t>(jpeg.size()));
  for (std::size_t i = 0; i < num_features; ++i) {
    writer.add(features.keypoints[i].x_px);
    writer.add(features.keypoints[i].y_px);
  }
  for (std::size_t i = 0; i < num_features; ++i) {
    const bool sees = i < keyframe.landmarks.size() && keyframe.landmarks[i].is_valid();
    const bool is_on_edge = i >= features.num_corners();
    writer.add(static_cast<std::uint8_t>(sees + 2 * is_on_edge));
  }
  writer.pad_to(4);
  writer.add_bytes(jpeg);
  return writer.finish();
}

std::string format_landmark(const Map& map, LandmarkId id, std::uint64_t number) {
  const Landmark* landmark = map.landmarks().find(id);
  if (!landmark) return format_reply(number, "no such landmark");
  json observations = json::array();
  for (const Observation& observation : landmark->observations) {
    observations.push_back(describe_observation(map, observation, *landmark));
  }
  return dump({{"type", "landmark"},
               {"request", number},
               {"id", id.value},
               {"submap", landmark->submap.value},
               {"position", array_of(landmark->position_in_world)},
               {"reference", id_or_null(landmark->reference)},
               {"num_visible", landmark->num_visible},
               {"num_found", landmark->num_found},
               {"observations", observations}});
}

ClientRequest parse_request(std::string_view text) {
  const json object = has_many_brackets(text)
                          ? json(json::value_t::discarded)
                          : json::parse(text.begin(), text.end(), nullptr, false);
  if (!object.is_object()) return {{}, "expected a JSON object"};
  const auto number = read_number(object, "request", kMaxNumber);
  if (!number) return {{}, "request: expected a non-negative integer"};
  return {number, read_content(object)};
}

}  // namespace waymark

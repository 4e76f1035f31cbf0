// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "waymark/view/text_message.h"

namespace waymark {
namespace {

using nlohmann::json;
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

template <class Show, class AnyId>
Content read_show(const json& object) {
  const auto id = read_number(object, "id", UINT32_MAX);
  if (!id) return std::string("id: expected a number of 32 bits");
  return Show{AnyId{static_cast<std::uint32_t>(*id)}};
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
  if (name == "keyframe") return read_show<ShowKeyframe, KeyframeId>(object);
  if (name == "landmark") return read_show<ShowLandmark, LandmarkId>(object);
  if (name == "rate") return read_rate(object);
  return std::string("do: not known");
}

/// Whether brackets may nest so deeply that a parser runs out of stack; no request has many.
bool has_many_brackets(std::string_view text) {
  constexpr std::ptrdiff_t kMany = 16;
  return std::count_if(text.begin(), text.end(), [](char c) { return c == '[' || c == '{'; }) >
         kMany;
}

}  // namespace

ClientRequest parse_request(std::string_view text) {
  ClientRequest request;
  const json object = has_many_brackets(text)
                          ? json(json::value_t::discarded)
                          : json::parse(text.begin(), text.end(), nullptr, false);
  if (!object.is_object()) {
    request.content = std::string("expected a JSON object");
    return request;
  }
  request.number = read_number(object, "request", kMaxNumber);
  if (!request.number) {
    request.content = std::string("request: expected a non-negative integer");
    return request;
  }
  request.content = read_content(object);
  return request;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/marker/known_markers.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/config_value.h"
#include "waymark/marker/family.h"

namespace waymark {
namespace {

constexpr ConfigRange kSizeRange = {.low = 1e-3, .high = 100.0};
constexpr ConfigRange kPlaceRange = {.low = -1e6, .high = 1e6};
/// Quaternions written with few digits are not of unit length.
constexpr double kMaxNormError = 1e-2;

const char* const kNoPoseWithout = "has {} but no {}, expected both or neither";

std::vector<double> read_numbers(const ConfigNode& node,
                                 const std::string& key,
                                 std::size_t count,
                                 const ConfigRange& range) {
  std::vector<double> numbers = config_doubles(node, key, range);
  if (numbers.size() == count) return numbers;
  throw InputError(node.where(),
                   fmt::format("{} has {} numbers, expected {}", key, numbers.size(), count));
}

std::optional<Rigid3> read_pose(const ConfigNode& marker, const std::string& name) {
  const ConfigNode* position = marker.find("position");
  const ConfigNode* rotation = marker.find("rotation");
  if (!position && !rotation) return std::nullopt;
  if (!position || !rotation) {
    throw InputError(marker.where(),
                     name + " " +
                         fmt::format(fmt::runtime(kNoPoseWithout),
                                     position ? "position" : "rotation",
                                     position ? "rotation" : "position"));
  }
  const auto p = read_numbers(*position, name + ".position", 3, kPlaceRange);
  const auto q = read_numbers(*rotation, name + ".rotation", 4, {.low = -1.01, .high = 1.01});
  const Eigen::Quaterniond turn(q[3], q[0], q[1], q[2]);
  if (std::abs(turn.norm() - 1.0) > kMaxNormError) {
    throw InputError(
        rotation->where(),
        fmt::format("{}.rotation has length {:.4f}, expected a unit quaternion x y z w",
                    name,
                    turn.norm()));
  }
  return Rigid3(turn.normalized(), {p[0], p[1], p[2]});
}

void check_keys(const ConfigNode& node,
                const std::string& prefix,
                const std::vector<std::string>& known) {
  for (std::size_t i = 0; i < node.keys.size(); ++i) {
    if (std::ranges::find(known, node.keys[i]) != known.end()) continue;
    fail_unknown_key(node.items[i], prefix + node.keys[i], known);
  }
}

void read_marker(const ConfigNode& node, const std::string& name, KnownMarkers& markers) {
  if (node.kind != ConfigNode::Kind::kMap || !node.find("id")) {
    throw InputError(
        node.where(),
        fmt::format("{} is {}, expected {{id: NUMBER, ...}}", name, describe_value(node)));
  }
  check_keys(node, name + ".", {"id", "size", "position", "rotation"});
  const ConfigNode& id_node = *node.find("id");
  const int id = config_int(id_node, name + ".id", {.low = 0, .high = 1e5});
  KnownMarker marker;
  if (const ConfigNode* size = node.find("size")) {
    marker.size_m = config_double(*size, name + ".size", kSizeRange);
  }
  marker.world_from_marker = read_pose(node, name);
  if (!markers.by_id.emplace(id, marker).second) {
    throw InputError(id_node.where(), fmt::format("{}.id {} is there twice", name, id));
  }
}

std::string format_marker(int id, const KnownMarker& marker) {
  std::string text = fmt::format("  - {{id: {}", id);
  if (marker.size_m) text += fmt::format(", size: {}", *marker.size_m);
  if (marker.world_from_marker) {
    const Eigen::Vector3d& p = marker.world_from_marker->translation;
    const Eigen::Vector4d q = marker.world_from_marker->rotation.coeffs();
    text += fmt::format(", position: [{:.9g}, {:.9g}, {:.9g}]", p.x(), p.y(), p.z());
    text += fmt::format(", rotation: [{:.9g}, {:.9g}, {:.9g}, {:.9g}]", q[0], q[1], q[2], q[3]);
  }
  return text + "}\n";
}

}  // namespace

double KnownMarkers::size_of(int id) const {
  const auto at = by_id.find(id);
  return at != by_id.end() && at->second.size_m ? *at->second.size_m : size_m;
}

const Rigid3* KnownMarkers::pose_of(int id) const {
  const auto at = by_id.find(id);
  return at != by_id.end() && at->second.world_from_marker ? &*at->second.world_from_marker
                                                           : nullptr;
}

KnownMarkers read_known_markers(const ConfigNode& document) {
  check_keys(document, "", {"family", "size", "markers"});
  KnownMarkers markers;
  if (const ConfigNode* family = document.find("family")) {
    markers.family = config_string(*family, "family");
    MarkerFamily(markers.family, family->where() + ": family");
  }
  if (const ConfigNode* size = document.find("size")) {
    markers.size_m = config_double(*size, "size", kSizeRange);
  }
  if (const ConfigNode* list = document.find("markers")) {
    if (list->kind != ConfigNode::Kind::kList) {
      throw InputError(list->where(),
                       fmt::format("markers is {}, expected a list of - {{id: NUMBER, ...}}",
                                   describe_value(*list)));
    }
    for (std::size_t i = 0; i < list->items.size(); ++i) {
      read_marker(list->items[i], fmt::format("markers[{}]", i), markers);
    }
  }
  return markers;
}

std::string format_known_markers(const KnownMarkers& markers) {
  std::string text;
  if (!markers.family.empty()) text += fmt::format("family: {}\n", markers.family);
  if (markers.size_m > 0.0) text += fmt::format("size: {}\n", markers.size_m);
  if (!markers.by_id.empty()) text += "markers:\n";
  for (const auto& [id, marker] : markers.by_id) text += format_marker(id, marker);
  return text;
}

std::optional<KnownMarkers> markers_to_look_for(const MarkerSettings& settings) {
  KnownMarkers markers;
  if (!settings.file.empty()) {
    markers = read_known_markers(parse_config(ConfigSource::from_file(settings.file)));
  }
  if (settings.family != "off") markers.family = settings.family;
  if (settings.size > 0.0) markers.size_m = settings.size;
  if (markers.family.empty()) {
    if (settings.file.empty()) return std::nullopt;
    throw InputError(settings.file, "names no family, expected one or markers.family");
  }
  const MarkerFamily family(markers.family, "markers.family");
  const bool has_size = std::ranges::any_of(
      markers.by_id, [](const auto& entry) { return entry.second.size_m.has_value(); });
  if (!(markers.size_m > 0.0) && !has_size) {
    throw InputError("markers.size", "is not set, expected the side of the black square in metres");
  }
  for (const auto& [id, marker] : markers.by_id) {
    if (id < family.size()) continue;
    throw InputError(settings.file,
                     fmt::format("has marker {}, expected ids below {}, which {} ends at",
                                 id,
                                 family.size(),
                                 markers.family));
  }
  return markers;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/join_by_markers.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "waymark/geometry/alignment.h"
#include "waymark/loop/odometry.h"
#include "waymark/map/align.h"
#include "waymark/marker/marker.h"

namespace waymark {
namespace {

/// Markers are where others say by this part of their side, and of the distance to these: the turn
/// of a single marker is known to a few hundredths.
constexpr double kSideTolerance = 0.5;
constexpr double kDistanceTolerance = 0.05;
constexpr double kSizeTolerance = 0.01;
/// Two frames are one: then markers of both that were surveyed hold what is joined.
constexpr double kSamePlaceM = 0.05;
constexpr double kSameTurnRad = 0.02;

/// A marker that two sub-maps know.
struct SharedMarker {
  const MapMarker* of_a;
  const MapMarker* of_b;
  Rigid3 a_from_marker;
  Rigid3 b_from_marker;
};

std::vector<SharedMarker> list_shared(const Map& map, SubmapId a, SubmapId b) {
  std::vector<SharedMarker> shared;
  for (const MapMarker& of_a : map.markers()) {
    if (map.submap_of(of_a) != a) continue;
    for (const MapMarker& of_b : map.markers()) {
      if (of_b.id != of_a.id || map.submap_of(of_b) != b) continue;
      if (std::abs(of_b.side_m - of_a.side_m) > kSizeTolerance * of_a.side_m) continue;
      shared.push_back({&of_a, &of_b, map.world_from_marker(of_a), map.world_from_marker(of_b)});
    }
  }
  return shared;
}

/// Those that a placing of b in a agrees with, which the marker `by` suggests.
std::vector<SharedMarker> agreeing(const std::vector<SharedMarker>& shared,
                                   const SharedMarker& by,
                                   const Rigid3& a_from_b) {
  std::vector<SharedMarker> found;
  for (const SharedMarker& marker : shared) {
    const double distance =
        (marker.a_from_marker.translation - by.a_from_marker.translation).norm();
    const double off =
        (a_from_b * marker.b_from_marker.translation - marker.a_from_marker.translation).norm();
    if (off <= kSideTolerance * marker.of_a->side_m + kDistanceTolerance * distance) {
      found.push_back(marker);
    }
  }
  return found;
}

/// Where b lies in a, and the markers that say so.
struct Placing {
  Rigid3 a_from_b;
  std::vector<SharedMarker> markers;
};

/// Nothing unless more than half of the markers that both know agree about it.
std::optional<Placing> place_by(const std::vector<SharedMarker>& shared) {
  std::vector<SharedMarker> best;
  for (const SharedMarker& by : shared) {
    std::vector<SharedMarker> found =
        agreeing(shared, by, by.a_from_marker * by.b_from_marker.inverse());
    if (found.size() > best.size()) best = std::move(found);
  }
  if (2 * best.size() <= shared.size()) return std::nullopt;
  std::vector<Eigen::Vector3d> in_a;
  std::vector<Eigen::Vector3d> in_b;
  for (const SharedMarker& marker : best) {
    for (std::size_t i = 0; i < 4; ++i) {
      in_a.push_back(marker.a_from_marker * marker_corner(i, marker.of_a->side_m));
      in_b.push_back(marker.b_from_marker * marker_corner(i, marker.of_b->side_m));
    }
  }
  const auto a_from_b = align_rigid(in_b, in_a);
  if (!a_from_b) return std::nullopt;
  return Placing{*a_from_b, std::move(best)};
}

bool is_nearly_the_same_frame(const Rigid3& a_from_b) {
  return a_from_b.translation.norm() < kSamePlaceM &&
         a_from_b.rotation.angularDistance(Eigen::Quaterniond::Identity()) < kSameTurnRad;
}

/// Each marker once, and none that is elsewhere now. Where markers of b were surveyed in a frame
/// that a does not have, they are markers like others in it.
void unite_markers(Map& map,
                   SubmapId b,
                   const std::vector<SharedMarker>& shared,
                   const Placing& placing) {
  const auto has = [](const std::vector<SharedMarker>& among, int id) {
    return std::ranges::any_of(among, [id](const SharedMarker& one) { return one.of_a->id == id; });
  };
  const SubmapId a = map.submap_of(*shared.front().of_a);
  std::vector<MapMarker> markers;
  for (MapMarker marker : map.markers()) {
    const SubmapId submap = map.submap_of(marker);
    const bool is_shared = (submap == a || submap == b) && has(shared, marker.id);
    if (is_shared && (submap == b || !has(placing.markers, marker.id))) continue;
    if (submap == b && !is_nearly_the_same_frame(placing.a_from_b)) {
      marker.surveyed_world_from_marker.reset();
    }
    markers.push_back(marker);
  }
  map.set_markers(std::move(markers));
}

bool join(Map& map, PlaceIndex& places, SubmapId a, SubmapId b) {
  const std::vector<SharedMarker> shared = list_shared(map, a, b);
  const auto placing = place_by(shared);
  if (!placing) return false;
  const KeyframeId parent = map.resolve(placing->markers.front().of_a->reference);
  const KeyframeId child = map.resolve(placing->markers.front().of_b->reference);
  // Of each part for itself, so that places seen again can contradict the markers.
  note_odometry(map);
  unite_markers(map, b, shared, *placing);
  transform_submap(map, b, Sim3(placing->a_from_b));
  const Rigid3 child_from_parent = map.keyframes().at(child).rig_from_world *
                                   map.keyframes().at(parent).rig_from_world.inverse();
  map.add_loop_edge({parent, child, Sim3(child_from_parent)});
  map.join_submaps(child, parent);
  places.join(b, a);
  return true;
}

bool is_part_in_metres(const Submap& submap) {
  return submap.root.is_valid() && !submap.joined_into.is_valid() && submap.is_metric;
}

}  // namespace

int join_by_markers(Map& map, PlaceIndex& places) {
  int num_joins = 0;
  const auto count = static_cast<std::uint32_t>(map.submaps().size());
  for (std::uint32_t b = 1; b < count; ++b) {
    for (std::uint32_t a = 0; a < b; ++a) {
      if (!is_part_in_metres(map.submaps()[b])) break;
      if (!is_part_in_metres(map.submaps()[a])) continue;
      num_joins += join(map, places, SubmapId{a}, SubmapId{b});
    }
  }
  return num_joins;
}

}  // namespace waymark

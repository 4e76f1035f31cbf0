// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/align_map.h"

#include <fmt/format.h>

#include <cmath>
#include <string_view>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/map/parts.h"

namespace waymark {
namespace {

constexpr std::int64_t kMaxAlignDifferenceNs = 20'000'000;
constexpr double kMaxKnownDistanceM = 1e6;  // Of places whose distance is known.
constexpr double kMaxAlignFactor = 1e6;
constexpr double kMaxAlignPositionM = 1e9;  // Of poses of a trajectory: on Earth, in any frame.

template <class Table, class Id>
SubmapId submap_in(const Table& table, Id id, std::string_view name, const std::string& where) {
  const auto* element = table.find(id);
  if (element) return element->submap;
  throw InputError(where,
                   fmt::format("names {} {}, which is not there, expected the id of one of the "
                               "map's {}",
                               name,
                               id.value,
                               table.size()));
}

SubmapId submap_of_place(const Map& map, const MapPlace& place, const std::string& where) {
  const auto* keyframe = std::get_if<KeyframeId>(&place);
  if (keyframe) return submap_in(map.keyframes(), *keyframe, "keyframe", where);
  return submap_in(map.landmarks(), std::get<LandmarkId>(place), "landmark", where);
}

/// Beyond this the numbers of maps, or their meaning, would suffer.
void check_factor(const std::string& where, double factor) {
  if (factor >= 1.0 / kMaxAlignFactor && factor <= kMaxAlignFactor) return;
  throw InputError(where,
                   fmt::format("would scale the map by {:.6g}, expected {:g} to {:g}",
                               factor,
                               1.0 / kMaxAlignFactor,
                               kMaxAlignFactor));
}

/// The sub-map that distances are in, if they are possible.
SubmapId submap_of_distances(const Map& map,
                             std::span<const KnownDistance> distances,
                             const std::string& where) {
  std::optional<SubmapId> submap;
  for (const KnownDistance& known : distances) {
    for (const MapPlace& place : {known.a, known.b}) {
      const SubmapId of_place = submap_of_place(map, place, where);
      if (submap.value_or(of_place) != of_place) {
        throw InputError(where, "names places of several sub-maps, expected one sub-map");
      }
      submap = of_place;
    }
    if (!(known.metres > 0.0 && known.metres <= kMaxKnownDistanceM)) {
      throw InputError(where,
                       fmt::format("is {} m, expected more than 0 and at most {:.0f}",
                                   known.metres,
                                   kMaxKnownDistanceM));
    }
  }
  if (!submap) throw InputError(where, "is empty, expected at least one distance");
  return *submap;
}

TimedPoses checked_poses(std::span<const StampedPose> trajectory,
                         const std::string& where,
                         std::vector<std::int64_t>& timestamps_ns,
                         std::vector<Rigid3>& poses) {
  for (const StampedPose& pose : trajectory) {
    const double farthest_m = pose.world_from_camera.translation.cwiseAbs().maxCoeff();
    if (!(farthest_m <= kMaxAlignPositionM)) {
      throw InputError(
          where,
          fmt::format(
              "has a pose {:g} m away, expected at most {:g}", farthest_m, kMaxAlignPositionM));
    }
    timestamps_ns.push_back(pose.timestamp_ns);
    poses.push_back(pose.world_from_camera);
  }
  return {timestamps_ns, poses};
}

}  // namespace

AlignedMap align_to_distances(const Map& map,
                              std::span<const KnownDistance> distances,
                              const std::string& where) {
  const SubmapId submap = submap_of_distances(map, distances, where);
  if (has_measured_ranges(map, submap)) {
    throw InputError(where,
                     fmt::format("is for sub-map {}, in which stereo or depth measured lengths, "
                                 "expected one whose scale is free",
                                 submap.value));
  }
  const std::optional<double> factor = scale_by_distances(map, distances);
  if (!factor)
    throw InputError(where, "is between two at the same place, expected two that are apart");
  check_factor(where, *factor);
  const Sim3 scale{Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero(), *factor};
  return {put_into_metres(Map::thaw(map), submap, scale),
          {fmt::format("sub-map {}: scaled by {:.6g}, now in metres", submap.value, *factor)}};
}

AlignedMap align_to_trajectory(const Map& map,
                               std::span<const StampedPose> trajectory,
                               const std::string& where) {
  std::vector<std::int64_t> timestamps_ns;
  std::vector<Rigid3> poses;
  const TimedPoses timed = checked_poses(trajectory, where, timestamps_ns, poses);
  AlignedMap aligned{Map::thaw(map), {}};
  bool has_fit = false;
  for (const auto& [submap, found] : fit_submaps(aligned.map, timed, kMaxAlignDifferenceNs)) {
    has_fit = has_fit || found;
    if (found) check_factor(where, found->trajectory_from_map.scale);
    aligned.report.push_back(
        found ? fmt::format("sub-map {}: {} keyframes with a pose, {:.3g} m rms off, scaled by "
                            "{:.6g}",
                            submap.value,
                            found->num_keyframes,
                            found->rms_m,
                            found->trajectory_from_map.scale)
              : fmt::format("sub-map {}: stays as it is, no three of its keyframes off a line have "
                            "a pose",
                            submap.value));
  }
  if (has_fit) return aligned;
  throw InputError(where,
                   "has no poses at the times of keyframes, expected three or more, not all on a "
                   "line, within 0.02 s");
}

AlignedMap align_upright(const Map& map, const Eigen::Vector3d& up, const std::string& where) {
  const double length = up.stableNorm();
  if (!(length > 1.0 / kMaxAlignFactor && length < kMaxAlignFactor)) {
    throw InputError(where, "is no direction, expected three numbers, not all 0, below 1000000");
  }
  const std::vector<SubmapId> submaps = submaps_by_size(map);
  if (submaps.empty()) throw InputError(where, "has no keyframes to level, expected some");
  AlignedMap aligned{Map::thaw(map), {}};
  aligned.report.push_back(
      fmt::format("sub-map {}: {} {} {} is +z now", submaps[0].value, up.x(), up.y(), up.z()));
  for (std::size_t i = 1; i < submaps.size(); ++i) {
    aligned.report.push_back(
        fmt::format("sub-map {}: stays as it is, having a frame of its own", submaps[i].value));
  }
  transform_submap(aligned.map, submaps[0], {turn_upright(up), Eigen::Vector3d::Zero(), 1.0});
  return aligned;
}

}  // namespace waymark

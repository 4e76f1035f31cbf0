// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/map/align.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/map/correction.h"
#include "waymark/map/parts.h"

namespace waymark {

void transform_submap(Map& map, SubmapId submap, const Sim3& new_from_old) {
  const KeyframeId root = map.submaps()[submap.value].root;
  const Sim3 root_from_new = Sim3(map.keyframes().at(root).rig_from_world) * new_from_old.inverse();
  MapCorrection correction;
  // Everything of a sub-map hangs below its root.
  correction.keyframes.push_back(
      {root,
       {root_from_new.rotation, new_from_old.scale * root_from_new.translation},
       new_from_old.scale});
  apply_correction(map, correction);
}

bool has_measured_ranges(const Map& map, SubmapId submap) {
  bool has_any = false;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    if (keyframe.submap != submap || has_any) return;
    has_any =
        std::ranges::any_of(keyframe.features->range_m, [](float range) { return range > 0.0f; });
  });
  return has_any;
}

Map declare_metric(const Map& map, SubmapId submap) {
  MapParts parts = take_apart(map);
  for (std::uint32_t i = 0; i < parts.submaps.size(); ++i) {
    if (map.resolve(SubmapId{i}) == submap) parts.submaps[i].is_metric = true;
  }
  return Map::restore(std::move(parts));
}

Map put_into_metres(Map map, SubmapId submap, const Sim3& new_from_old) {
  transform_submap(map, submap, new_from_old);
  if (map.submaps()[submap.value].is_metric) return map;
  return declare_metric(map, submap);
}

Eigen::Vector3d camera_position(const Keyframe& keyframe) {
  return (keyframe.rig().cameras[0].cam_from_rig * keyframe.rig_from_world).origin_in_source();
}

namespace {

Eigen::Vector3d position_of(const Map& map, const MapPlace& place) {
  const auto* keyframe = std::get_if<KeyframeId>(&place);
  if (keyframe) return camera_position(map.keyframes().at(*keyframe));
  return map.landmarks().at(std::get<LandmarkId>(place)).position_in_world;
}

}  // namespace

std::optional<double> scale_by_distances(const Map& map, std::span<const KnownDistance> known) {
  double sum = 0.0;
  double sum_squares = 0.0;
  for (const KnownDistance& distance : known) {
    const double length = (position_of(map, distance.a) - position_of(map, distance.b)).norm();
    sum += distance.metres * length;
    sum_squares += length * length;
  }
  if (!(sum > 0.0)) return std::nullopt;
  return sum / sum_squares;
}

Eigen::Quaterniond turn_upright(const Eigen::Vector3d& up) {
  return Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ());
}

std::optional<TrajectoryFit> fit_trajectory(const Map& map,
                                            SubmapId submap,
                                            const TimedPoses& trajectory,
                                            std::int64_t max_difference_ns,
                                            bool is_scale_free) {
  std::vector<std::pair<std::int64_t, Eigen::Vector3d>> mapped;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    if (keyframe.submap != submap) return;
    mapped.push_back({keyframe.timestamp_ns, camera_position(keyframe)});
  });
  std::ranges::stable_sort(mapped, {}, &std::pair<std::int64_t, Eigen::Vector3d>::first);
  std::vector<std::int64_t> times;
  for (const auto& [time, position] : mapped) times.push_back(time);
  std::vector<Eigen::Vector3d> in_map;
  std::vector<Eigen::Vector3d> in_trajectory;
  for (const PosePair& pair : associate(times, trajectory.timestamps_ns, max_difference_ns)) {
    in_map.push_back(mapped[pair.a].second);
    in_trajectory.push_back(trajectory.world_from_rig[pair.b].translation);
  }
  TrajectoryFit fit;
  fit.num_keyframes = in_map.size();
  if (is_scale_free) {
    const std::optional<Sim3> similarity = align_similarity(in_map, in_trajectory);
    if (!similarity) return std::nullopt;
    fit.trajectory_from_map = *similarity;
  } else {
    const std::optional<Rigid3> rigid = align_rigid(in_map, in_trajectory);
    if (!rigid) return std::nullopt;
    fit.trajectory_from_map = Sim3(*rigid);
  }
  double sum = 0.0;
  for (std::size_t i = 0; i < in_map.size(); ++i) {
    sum += (fit.trajectory_from_map * in_map[i] - in_trajectory[i]).squaredNorm();
  }
  fit.rms_m = std::sqrt(sum / static_cast<double>(in_map.size()));
  return fit;
}

std::vector<std::pair<SubmapId, std::optional<TrajectoryFit>>> fit_submaps(
    Map& map, const TimedPoses& trajectory, std::int64_t max_difference_ns) {
  std::vector<std::pair<SubmapId, std::optional<TrajectoryFit>>> fits;
  for (const SubmapId submap : submaps_by_size(map)) {
    const bool is_scale_free = !has_measured_ranges(map, submap);
    fits.emplace_back(submap,
                      fit_trajectory(map, submap, trajectory, max_difference_ns, is_scale_free));
    const std::optional<TrajectoryFit>& fit = fits.back().second;
    if (fit) map = put_into_metres(std::move(map), submap, fit->trajectory_from_map);
  }
  return fits;
}

}  // namespace waymark

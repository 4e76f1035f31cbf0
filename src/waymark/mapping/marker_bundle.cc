// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/marker_bundle.h"

#include <algorithm>
#include <array>

#include "waymark/base/check.h"

namespace waymark {
namespace {

/// Of corners in images, in px: small against those of features.
constexpr double kCornerSigmaPx = 0.3;
/// Of corners in their square, as a part of its side.
constexpr double kSquareSigma = 1e-3;

struct MarkerInKeyframe {
  std::uint32_t pose;
  const MarkerObservation* marker;
};

std::vector<MarkerInKeyframe> list_observations(const Map& map,
                                                std::span<const KeyframeId> keyframes,
                                                const MapMarker& of_map) {
  const SubmapId submap = map.submap_of(of_map);
  std::vector<MarkerInKeyframe> observations;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const Keyframe& keyframe = map.keyframes().at(keyframes[i]);
    if (!keyframe.markers || keyframe.submap != submap) continue;
    for (const MarkerObservation& marker : *keyframe.markers) {
      if (marker.id == of_map.id) observations.push_back({static_cast<std::uint32_t>(i), &marker});
    }
  }
  return observations;
}

/// A camera one side of the marker before its middle, which looks at it.
std::shared_ptr<const Rig> rig_before(double side) {
  const Eigen::Quaterniond facing(Eigen::AngleAxisd(EIGEN_PI, Eigen::Vector3d::UnitX()));
  RigCamera camera;
  camera.cam_from_rig = Rigid3(facing, {0.0, 0.0, side});
  return std::make_shared<const Rig>(Rig{.cameras = {camera}});
}

/// The corner of a square of this side as that camera sees it, with its distance: in all, a place
/// with the same standard deviation in any direction.
Measurement corner_measurement(const Rig& rig, std::size_t corner, double side) {
  const Eigen::Vector3d seen = rig.cameras[0].cam_from_rig * marker_corner(corner, side);
  const double range = seen.norm();
  const double sigma = kSquareSigma * side;
  Measurement measured;
  measured.bearing = (seen / range).cast<float>();
  const Eigen::Vector3d bearing = measured.bearing.cast<double>().normalized();
  const Eigen::Vector3d across = bearing.unitOrthogonal();
  Matrix23d tangent;
  tangent << across.transpose(), bearing.cross(across).transpose();
  measured.level_pixel_from_bearing = (range / sigma * tangent).cast<float>();
  measured.inverse_range = static_cast<float>(1.0 / range);
  measured.inverse_range_sigma = static_cast<float>(sigma / (range * range));
  return measured;
}

Measurement observation_measurement(const MarkerObservation& marker, std::size_t corner) {
  return {marker.camera,
          marker.bearings[corner],
          marker.pixel_from_bearing[corner] / static_cast<float>(kCornerSigmaPx)};
}

}  // namespace

std::vector<std::shared_ptr<const Rig>> add_markers(const Map& map,
                                                    std::span<const KeyframeId> keyframes,
                                                    BundleProblem& problem) {
  WAYMARK_CHECK(!problem.calibration);
  std::vector<std::shared_ptr<const Rig>> rigs;
  for (const MapMarker& marker : map.markers()) {
    const std::vector<MarkerInKeyframe> observations = list_observations(map, keyframes, marker);
    if (observations.size() < 2) continue;
    const auto rig = rigs.emplace_back(rig_before(marker.side_m));
    const auto& surveyed = marker.surveyed_world_from_marker;
    const Rigid3 world_from_marker = surveyed ? *surveyed : map.world_from_marker(marker);
    const auto pose = static_cast<std::uint32_t>(problem.rig_from_world.size());
    problem.rig_from_world.push_back(world_from_marker.inverse());
    problem.rigs.push_back(rig.get());
    problem.is_pose_fixed.push_back(surveyed.has_value());
    for (std::size_t corner = 0; corner < 4; ++corner) {
      const auto point = static_cast<std::uint32_t>(problem.points.size());
      problem.points.push_back(world_from_marker * marker_corner(corner, marker.side_m));
      for (const MarkerInKeyframe& observation : observations) {
        problem.observations.push_back(
            {observation_measurement(*observation.marker, corner), observation.pose, point});
      }
      problem.observations.push_back(
          {corner_measurement(*rig, corner, marker.side_m), pose, point});
    }
  }
  return rigs;
}

bool is_held_by_survey(const Map& map, SubmapId submap) {
  return std::ranges::any_of(map.markers(), [&](const MapMarker& marker) {
    return marker.surveyed_world_from_marker && map.submap_of(marker) == submap;
  });
}

}  // namespace waymark

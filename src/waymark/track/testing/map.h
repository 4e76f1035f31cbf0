// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "waymark/camera/scaled_camera.h"
#include "waymark/image/small_image.h"
#include "waymark/map/map.h"
#include "waymark/match/testing/scene.h"
#include "waymark/simulate/testing/points.h"

namespace waymark {

/// A map of a simulated cloud as a perfect mapper would make it: keyframes at their true poses,
/// landmarks at their true places, each feature associated with what it shows. Tests then damage
/// it.
class TestMap {
 public:
  TestMap(int num_cameras, PointCloud cloud, PointNoise noise, bool is_metric)
      : rig(make_test_rig(num_cameras)), cloud(std::move(cloud)), noise(noise) {
    submap = map.add_submap(is_metric);
  }

  PointObservation look(const Rigid3& world_from_rig, std::uint64_t frame) const {
    return observe(cloud, rig, world_from_rig, noise, frame);
  }

  /// A keyframe without associations, its frame having the number of its id.
  KeyframeId add_bare_keyframe(const Rigid3& world_from_rig) {
    const auto number = static_cast<std::uint32_t>(seen.size());
    seen.push_back(look(world_from_rig, number));
    Keyframe keyframe;
    keyframe.frame = FrameId{number};
    keyframe.timestamp_ns = 100'000'000 * std::int64_t{number};
    keyframe.submap = submap;
    keyframe.rig_from_world = world_from_rig.inverse();
    if (map.submaps()[submap.value].root.is_valid()) keyframe.parent = KeyframeId{number - 1};
    keyframe.features = seen.back().features;
    return map.add_keyframe(std::move(keyframe));
  }

  /// A keyframe that sees every landmark of which the index in the cloud is a multiple of stride.
  KeyframeId add_keyframe(const Rigid3& world_from_rig, std::uint32_t stride = 1) {
    const KeyframeId id = add_bare_keyframe(world_from_rig);
    const PointObservation& view = seen[id.value];
    for (std::uint32_t i = 0; i < view.features->num_primary; ++i) {
      const std::uint32_t index = view.landmark_of_feature[i];
      if (index == kNoLandmark || index % stride != 0) continue;
      const LandmarkId landmark = landmark_at(index, id);
      map.observe(id, i, landmark);
    }
    return id;
  }

  /// The landmark of a point of the cloud, made where there is none yet.
  LandmarkId landmark_at(std::uint32_t index, KeyframeId reference) {
    const auto [at, is_new] = landmark_of_point.try_emplace(index);
    if (is_new) {
      const PointLandmark& point = cloud.landmarks[index];
      at->second = map.add_landmark(submap, point.position, reference);
      const Eigen::Vector3d eye = map.keyframes().at(reference).rig_from_world.origin_in_source();
      map.set_appearance(at->second,
                         {point.descriptor, (eye - point.position).normalized(), point.size_m});
      point_of_landmark[at->second] = index;
    }
    return at->second;
  }

  /// The true landmark of each feature of a view; invalid where the map has none.
  std::vector<LandmarkId> true_associations(const PointObservation& view) const {
    std::vector<LandmarkId> landmarks(view.features->size());
    for (std::uint32_t i = 0; i < view.features->num_primary; ++i) {
      const auto found = landmark_of_point.find(view.landmark_of_feature[i]);
      if (found != landmark_of_point.end()) landmarks[i] = found->second;
    }
    return landmarks;
  }

  std::shared_ptr<const Rig> rig;
  PointCloud cloud;
  PointNoise noise;
  Map map;
  SubmapId submap;
  std::vector<PointObservation> seen;  ///< Per keyframe.
  std::map<std::uint32_t, LandmarkId> landmark_of_point;
  std::map<LandmarkId, std::uint32_t> point_of_landmark;
};

/// A cloud some metres before a camera at the origin.
inline PointCloud cloud_ahead(int count = 1500) {
  return scatter_in({-5.0, -3.0, 4.0}, {5.0, 3.0, 9.0}, count, 6.0, 3);
}

/// What a camera at the origin of the cloud sees of walls that are far away.
inline std::shared_ptr<const SmallImage> far_image(const Camera& camera,
                                                   const Rigid3& world_from_cam) {
  const ScaledCamera small =
      ScaledCamera({std::shared_ptr<void>(), &camera},
                   small_image_factor(camera.width_px(), camera.height_px()));
  SmallImage image;
  image.grey = Image(small.width_px(), small.height_px());
  for (int y = 0; y < small.height_px(); ++y) {
    for (int x = 0; x < small.width_px(); ++x) {
      const Eigen::Vector2d pixel(x, y);
      Eigen::Vector3d bearing;
      std::uint8_t is_valid = 0;
      small.unproject({&pixel, 1}, {&bearing, 1}, {&is_valid, 1});
      const Eigen::Vector3d to = world_from_cam.rotation * bearing;
      const double grey = 128.0 + 60.0 * std::sin(7.0 * to.x() + 3.0 * to.y()) +
                          50.0 * std::sin(5.0 * to.y() - 4.0 * to.x() * to.z());
      image.grey.row(y)[x] = static_cast<std::uint8_t>(grey);
    }
  }
  return std::make_shared<const SmallImage>(std::move(image));
}

inline Rigid3 pose_at(double x, double y = 0.0, double z = 0.0, double yaw_rad = 0.0) {
  return make_test_pose({x, y, z}, {0.0, yaw_rad, 0.0});
}

/// Half a metre apart; not on a line, along which an alignment could turn.
inline Rigid3 row_pose(std::uint32_t keyframe) {
  return pose_at(0.5 * keyframe, 0.2 * std::sin(2.0 * keyframe), 0.2 * std::cos(1.5 * keyframe));
}

}  // namespace waymark

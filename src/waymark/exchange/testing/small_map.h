// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/camera/camchain.h"
#include "waymark/features/feature_geometry.h"
#include "waymark/map/map.h"
#include "waymark/mapping/appearance.h"

namespace waymark::testing {

/// What a small map shows: points 4 to 8 m ahead of keyframes that move to the right, each with all
/// points it sees and one key point more that shows none. Keyframes 0 and 2 close a loop where they
/// are of one sub-map.
struct SmallMap {
  CameraDescription camera;
  std::vector<Eigen::Vector3d> points;
  std::vector<Rigid3> cam_from_world;
  std::array<std::int64_t, 3> timestamps_ns = {100'500'000'000, 101'500'000'000, 102'500'000'000};
  std::array<KeyframeId, 3> parents = {KeyframeId{}, KeyframeId{0}, KeyframeId{1}};
  /// Added to where each keyframe sees each point.
  std::array<std::vector<Eigen::Vector2d>, 3> moved_px;

  Map map() const;
};

inline CameraDescription perspective_camera() {
  CameraDescription camera;
  camera.camera_model = "pinhole";
  camera.intrinsics = {400.0, 405.0, 318.0, 241.0};
  camera.distortion_model = "radtan";
  camera.distortion_coeffs = {-0.2, 0.03, 1e-4, -2e-4, 0.0};
  camera.width_px = 640;
  camera.height_px = 480;
  return camera;
}

inline CameraDescription camera_around(int width_px) {
  CameraDescription camera;
  camera.camera_model = "equirectangular";
  camera.width_px = width_px;
  camera.height_px = width_px / 2;
  return camera;
}

inline SmallMap make_small_map(const CameraDescription& camera = perspective_camera()) {
  SmallMap small;
  small.camera = camera;
  Rng rng(3, 0);
  for (int i = 0; i < 30; ++i) {
    small.points.emplace_back(
        4.0 * rng.uniform() - 2.0, 2.0 * rng.uniform() - 1.0, 4.0 + 4.0 * rng.uniform());
  }
  for (int id = 0; id < 3; ++id) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.03 * id, Eigen::Vector3d::UnitY()));
    small.cam_from_world.push_back(Rigid3(turn, {0.2 * id, 0.0, 0.05 * id}).inverse());
  }
  small.moved_px.fill(std::vector<Eigen::Vector2d>(30, Eigen::Vector2d::Zero()));
  return small;
}

/// Feature i shows point i.
inline std::shared_ptr<const Features> features_of(const SmallMap& small,
                                                   std::size_t keyframe,
                                                   const std::shared_ptr<const Rig>& rig,
                                                   Rng& rng) {
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3d& point : small.points) {
    points.push_back(small.cam_from_world[keyframe] * point);
  }
  points.emplace_back(0.0, 0.0, 6.0);
  std::vector<Eigen::Vector2d> pixels(points.size());
  std::vector<std::uint8_t> is_visible(points.size());
  rig->cameras[0].camera->project(points, pixels, is_visible);
  auto features = std::make_shared<Features>();
  features->rig = rig;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i < small.points.size()) pixels[i] += small.moved_px[keyframe][i];
    features->keypoints.push_back({.x_px = static_cast<float>(pixels[i].x()),
                                   .y_px = static_cast<float>(pixels[i].y()),
                                   .angle_rad = static_cast<float>(-M_PI / 2.0),
                                   .level = static_cast<std::uint8_t>(i % 8)});
    features->descriptors.push_back({rng.next(), rng.next(), rng.next(), rng.next()});
  }
  features->num_primary = features->size();
  features->partner.assign(features->size(), kNoFeature);
  features->range_m.assign(features->size(), 0.0f);
  features->inverse_range_sigma.assign(features->size(), 0.0f);
  derive_geometry(*rig, *features);
  return features;
}

inline Map SmallMap::map() const {
  Map map;
  Rng rng(3, 1);
  const auto rig = std::make_shared<const Rig>(make_rig({{{camera, Rigid3()}}, {}, {}}));
  for (std::size_t id = 0; id < 3; ++id) {
    Keyframe keyframe;
    keyframe.frame = FrameId{static_cast<std::uint32_t>(id)};
    keyframe.timestamp_ns = timestamps_ns[id];
    keyframe.parent = parents[id];
    keyframe.submap = keyframe.parent.is_valid() ? map.keyframes().at(keyframe.parent).submap
                                                 : map.add_submap(false);
    keyframe.rig_from_world = cam_from_world[id];
    keyframe.features = features_of(*this, id, rig, rng);
    map.add_keyframe(std::move(keyframe));
  }
  const auto submap_of = [&](std::uint32_t id) {
    return map.keyframes().at(KeyframeId{id}).submap;
  };
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const LandmarkId added = map.add_landmark(SubmapId{0}, points[i], KeyframeId{0});
    for (std::uint32_t id = 0; id < 3; ++id) {
      if (submap_of(id) == SubmapId{0}) map.observe(KeyframeId{id}, i, added);
    }
    map.set_appearance(added, describe_landmark(map, added));
  }
  if (submap_of(2) != submap_of(0)) return map;
  map.add_loop_edge(
      {KeyframeId{0}, KeyframeId{2}, Sim3(cam_from_world[2] * cam_from_world[0].inverse())});
  return map;
}

/// As a map, seen by a camera that is plain, distorted or fisheye.
inline Map small_map(const std::string& kind) {
  CameraDescription camera = perspective_camera();
  if (kind == "plain") {
    camera.distortion_model = "none";
    camera.distortion_coeffs.clear();
  } else if (kind == "fisheye") {
    camera.distortion_model = "equidistant";
    camera.distortion_coeffs = {-0.2, 0.03, 0.0, 0.0};
  }
  return make_small_map(camera).map();
}

}  // namespace waymark::testing

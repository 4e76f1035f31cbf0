// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/export_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/image/pyramid.h"
#include "waymark/input/decode.h"
#include "waymark/mapping/associate.h"

namespace waymark {
namespace {

/// Index of a camera in the scene, which gets it if it has it not yet.
std::size_t index_of(const RigCamera& camera, std::vector<CameraDescription>& cameras) {
  if (!camera.description) {
    throw InputError("export", "a camera of the map was made without a description, expected one");
  }
  const auto found = std::find_if(cameras.begin(), cameras.end(), [&](const auto& other) {
    return other.is_same(*camera.description);
  });
  if (found != cameras.end()) return static_cast<std::size_t>(found - cameras.begin());
  cameras.push_back(*camera.description);
  return cameras.size() - 1;
}

/// Distance in pixels between where a landmark should be seen and where it was; nothing where it
/// cannot be seen.
std::optional<double> reprojection_error(const Camera& camera,
                                         const Eigen::Vector3d& point_in_cam,
                                         const Eigen::Vector2d& measured) {
  Eigen::Vector2d pixel;
  std::uint8_t is_visible = 0;
  camera.project({&point_in_cam, 1}, {&pixel, 1}, {&is_visible, 1});
  if (!is_visible) return std::nullopt;
  Eigen::Vector2d error = (pixel - measured).cwiseAbs();
  const double wrap = camera.wrap_width_px();
  if (wrap > 0.0) error.x() = std::min(error.x(), wrap - error.x());
  return error.norm();
}

/// The same of a feature of camera 0; where the camera's model is unknown by what the feature
/// holds.
std::optional<double> sighting_error(const Keyframe& keyframe,
                                     std::uint32_t feature,
                                     const Eigen::Vector3d& position_in_world) {
  const RigCamera& camera = keyframe.rig->cameras[0];
  const Keypoint& keypoint = keyframe.features->keypoints[feature];
  if (camera.camera->can_project()) {
    const Rigid3 cam_from_world = camera.cam_from_rig * keyframe.rig_from_world;
    return reprojection_error(
        *camera.camera, cam_from_world * position_in_world, {keypoint.x_px, keypoint.y_px});
  }
  const std::optional<double> squared = squared_residual(keyframe, feature, position_in_world);
  if (!squared) return std::nullopt;
  return Pyramid::scale(keypoint.level) * std::sqrt(*squared);
}

class SceneBuilder {
 public:
  SceneBuilder(const Map& map, SubmapId submap) : map_(map), submap_(submap) {}

  ExportScene build() {
    map_.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
      if (keyframe.submap == submap_) add_view(id, keyframe);
    });
    map_.landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
      if (landmark.submap == submap_) add_point(id, landmark);
    });
    return std::move(scene_);
  }

 private:
  void add_view(KeyframeId id, const Keyframe& keyframe) {
    ExportView view;
    view.name = fmt::format("{:06}_{}.jpg", id.value, keyframe.timestamp_ns);
    view.keyframe = id;
    view.camera = index_of(keyframe.rig->cameras[0], scene_.cameras);
    view.cam_from_world = keyframe.rig->cameras[0].cam_from_rig * keyframe.rig_from_world;
    const Features& features = *keyframe.features;
    for (std::size_t i = 0; i < features.num_primary; ++i) {
      view.pixels.emplace_back(features.keypoints[i].x_px, features.keypoints[i].y_px);
    }
    view.points.assign(features.num_primary, kNoPoint);
    view_of_[id] = static_cast<std::uint32_t>(scene_.views.size());
    scene_.views.push_back(std::move(view));
  }

  void add_point(LandmarkId id, const Landmark& landmark) {
    ExportPoint point;
    point.landmark = id;
    point.position_in_world = landmark.position_in_world;
    KeyframeId last;
    for (const Observation& observation : landmark.observations) {
      const std::uint32_t view_index = view_of_.at(observation.keyframe);
      const ExportView& view = scene_.views[view_index];
      if (observation.feature >= view.pixels.size() || observation.keyframe == last) continue;
      const std::optional<double> error = sighting_error(
          map_.keyframes().at(observation.keyframe), observation.feature, point.position_in_world);
      if (!error || *error > kMaxExportErrorPx) continue;
      point.sightings.push_back({view_index, observation.feature});
      point.error_px += *error;
      last = observation.keyframe;
    }
    if (point.sightings.size() < 2) return;
    point.error_px /= static_cast<double>(point.sightings.size());
    for (const ExportSighting& sighting : point.sightings) {
      scene_.views[sighting.view].points[sighting.feature] =
          static_cast<std::uint32_t>(scene_.points.size());
    }
    scene_.points.push_back(std::move(point));
  }

  const Map& map_;
  SubmapId submap_;
  ExportScene scene_;
  std::map<KeyframeId, std::uint32_t> view_of_;
};

/// The mean of what the images show of each point.
void color_points(const KeyframeImages& images, ExportScene& scene) {
  std::vector<Eigen::Vector4i> sums(scene.points.size(), Eigen::Vector4i::Zero());
  for (const ExportView& view : scene.views) {
    const auto found = images.find(view.keyframe);
    if (found == images.end()) continue;
    const CameraDescription& camera = scene.cameras[view.camera];
    const std::optional<ColorImage> image = decode_color_image(*found->second);
    if (!image || image->width_px != camera.width_px || image->height_px != camera.height_px) {
      continue;
    }
    for (std::size_t i = 0; i < view.pixels.size(); ++i) {
      if (view.points[i] == kNoPoint) continue;
      const long x = std::clamp(std::lround(view.pixels[i].x()), 0l, image->width_px - 1l);
      const long y = std::clamp(std::lround(view.pixels[i].y()), 0l, image->height_px - 1l);
      const Rgb& rgb = image->row(static_cast<int>(y))[x];
      sums[view.points[i]] += Eigen::Vector4i(rgb[0], rgb[1], rgb[2], 1);
    }
  }
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const int count = sums[i][3];
    if (count == 0) continue;
    for (int c = 0; c < 3; ++c) {
      scene.points[i].color[static_cast<std::size_t>(c)] =
          static_cast<std::uint8_t>((sums[i][c] + count / 2) / count);
    }
  }
}

}  // namespace

std::vector<StampedPose> keyframe_trajectory(const Map& map, SubmapId submap) {
  std::vector<StampedPose> poses;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    if (keyframe.submap != submap) return;
    const Rigid3 cam_from_world = keyframe.rig->cameras[0].cam_from_rig * keyframe.rig_from_world;
    poses.push_back({keyframe.timestamp_ns, cam_from_world.inverse()});
  });
  std::stable_sort(poses.begin(), poses.end(), [](const StampedPose& a, const StampedPose& b) {
    return a.timestamp_ns < b.timestamp_ns;
  });
  return poses;
}

ExportScene make_export_scene(const Map& map, SubmapId submap, const KeyframeImages& images) {
  ExportScene scene = SceneBuilder(map, submap).build();
  color_points(images, scene);
  return scene;
}

}  // namespace waymark

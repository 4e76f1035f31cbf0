// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/export_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/features/pyramid.h"
#include "waymark/input/decode.h"
#include "waymark/mapping/associate.h"

namespace waymark {
namespace {

/// Index of a camera of a rig in the scene, which gets it if it has it not yet.
std::size_t index_of(const RigCamera& camera, ExportScene& scene) {
  if (!camera.description) {
    throw InputError("export", "a camera of the map was made without a description, expected one");
  }
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    const Rigid3& place = scene.cam_from_rig[i];
    if (place.translation == camera.cam_from_rig.translation &&
        place.rotation.coeffs() == camera.cam_from_rig.rotation.coeffs() &&
        scene.cameras[i].is_same(*camera.description)) {
      return i;
    }
  }
  scene.cameras.push_back(*camera.description);
  scene.cam_from_rig.push_back(camera.cam_from_rig);
  return scene.cameras.size() - 1;
}

/// Where a view shows a point, and how far that is from where it should, in pixels.
struct SightedPixel {
  Eigen::Vector2d pixel;
  double error_px;
};

/// Whether a feature, of either camera, is a point on an edge.
bool is_on_edge(const Features& features, std::uint32_t feature) {
  const bool is_primary = feature < features.num_primary;
  return features.is_edge(is_primary ? feature : features.partner[feature]);
}

/// A feature that shows a point; nothing where that cannot be seen. Of points on edges the place
/// along the edge is not measured: that is where it should be.
std::optional<SightedPixel> sight_projected(const Camera& camera,
                                            const Eigen::Vector3d& point_in_cam,
                                            const Keypoint& keypoint,
                                            bool is_edge) {
  Eigen::Vector2d predicted;
  std::uint8_t is_visible = 0;
  camera.project({&point_in_cam, 1}, {&predicted, 1}, {&is_visible, 1});
  if (!is_visible) return std::nullopt;
  const Eigen::Vector2d measured(keypoint.x_px, keypoint.y_px);
  Eigen::Vector2d off = measured - predicted;
  const double wrap = camera.wrap_width_px();
  if (wrap > 0.0) off.x() = std::remainder(off.x(), wrap);
  if (!is_edge) return SightedPixel{measured, off.norm()};
  const Eigen::Vector2d across = edge_normal(keypoint.angle_rad).cast<double>();
  const double off_across = across.dot(off);
  return SightedPixel{predicted + off_across * across, std::abs(off_across)};
}

/// The same of a feature of a keyframe; where the camera's model is unknown by what the feature
/// holds.
std::optional<SightedPixel> sight(const Keyframe& keyframe,
                                  std::size_t rig_camera,
                                  std::uint32_t feature,
                                  const Eigen::Vector3d& position_in_world) {
  const RigCamera& camera = keyframe.rig().cameras[rig_camera];
  const Features& features = *keyframe.features;
  const Keypoint& keypoint = features.keypoints[feature];
  if (camera.camera->can_project()) {
    const Rigid3 cam_from_world = camera.cam_from_rig * keyframe.rig_from_world;
    return sight_projected(*camera.camera,
                           cam_from_world * position_in_world,
                           keypoint,
                           is_on_edge(features, feature));
  }
  const std::optional<double> squared = squared_residual(keyframe, feature, position_in_world);
  if (!squared) return std::nullopt;
  return SightedPixel{{keypoint.x_px, keypoint.y_px},
                      Pyramid::scale(keypoint.level) * std::sqrt(*squared)};
}

class SceneBuilder {
 public:
  SceneBuilder(const Map& map, SubmapId submap, ExportCameras cameras)
      : map_(map), submap_(submap), cameras_(cameras) {}

  ExportScene build() {
    map_.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
      if (keyframe.submap == submap_) add_views(id, keyframe);
    });
    map_.landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
      if (landmark.submap == submap_) add_point(id, landmark);
    });
    return std::move(scene_);
  }

 private:
  void add_views(KeyframeId id, const Keyframe& keyframe) {
    first_view_[id] = static_cast<std::uint32_t>(scene_.views.size());
    const std::size_t num_cameras =
        cameras_ == ExportCameras::kAll ? keyframe.rig().cameras.size() : 1;
    for (std::size_t camera = 0; camera < num_cameras; ++camera) add_view(id, keyframe, camera);
  }

  void add_view(KeyframeId id, const Keyframe& keyframe, std::size_t rig_camera) {
    const RigCamera& camera = keyframe.rig().cameras[rig_camera];
    ExportView view;
    view.name = fmt::format("{:06}_{}.jpg", id.value, keyframe.timestamp_ns);
    if (cameras_ == ExportCameras::kAll && keyframe.rig().cameras.size() > 1) {
      view.name = fmt::format("cam{}/{}", rig_camera, view.name);
    }
    view.keyframe = id;
    view.timestamp_ns = keyframe.timestamp_ns;
    view.rig_camera = rig_camera;
    view.camera = index_of(camera, scene_);
    view.cam_from_world = camera.cam_from_rig * keyframe.rig_from_world;
    const Features& features = *keyframe.features;
    const std::size_t begin = rig_camera == 0 ? 0 : features.num_primary;
    const std::size_t end = rig_camera == 0 ? features.num_primary : features.size();
    for (std::size_t i = begin; i < end; ++i) {
      view.pixels.emplace_back(features.keypoints[i].x_px, features.keypoints[i].y_px);
    }
    view.points.assign(view.pixels.size(), kNoPoint);
    scene_.views.push_back(std::move(view));
  }

  /// An observation, if the view is there, has none yet and shows the point where it should be.
  void add_observation(const Keyframe& keyframe,
                       std::uint32_t first_view,
                       std::uint32_t feature,
                       ExportPoint& point) {
    const std::size_t num_primary = keyframe.features->num_primary;
    const std::size_t rig_camera = feature < num_primary ? 0 : 1;
    if (rig_camera > 0 && cameras_ == ExportCameras::kFirst) return;
    const auto view = first_view + static_cast<std::uint32_t>(rig_camera);
    for (const ExportObservation& other : point.observations) {
      if (other.view == view) return;
    }
    const std::optional<SightedPixel> sighted =
        sight(keyframe, rig_camera, feature, point.position_in_world);
    if (!sighted || sighted->error_px > kMaxExportErrorPx) return;
    const auto first_feature = static_cast<std::uint32_t>(rig_camera == 0 ? 0 : num_primary);
    point.observations.push_back({view, feature - first_feature});
    point.error_px += sighted->error_px;
    scene_.views[view].pixels[feature - first_feature] = sighted->pixel;
  }

  void add_point(LandmarkId id, const Landmark& landmark) {
    ExportPoint point;
    point.landmark = id;
    point.position_in_world = landmark.position_in_world;
    for (const Observation& observation : landmark.observations) {
      const Keyframe& keyframe = map_.keyframes().at(observation.keyframe);
      const std::uint32_t first_view = first_view_.at(observation.keyframe);
      add_observation(keyframe, first_view, observation.feature, point);
      const FeatureArray<std::uint32_t>& partner = keyframe.features->partner;
      if (observation.feature < partner.size() && partner[observation.feature] != kNoFeature) {
        add_observation(keyframe, first_view, partner[observation.feature], point);
      }
    }
    if (point.observations.size() < 2) return;
    point.error_px /= static_cast<double>(point.observations.size());
    for (const ExportObservation& observation : point.observations) {
      ExportView& view = scene_.views[observation.view];
      view.points[observation.feature] = static_cast<std::uint32_t>(scene_.points.size());
      const Eigen::Vector3d position_in_view = view.cam_from_world * point.position_in_world;
      point.normal -= view.cam_from_world.rotation.conjugate() * position_in_view.normalized();
    }
    point.normal = point.normal.stableNormalized();
    scene_.points.push_back(std::move(point));
  }

  const Map& map_;
  SubmapId submap_;
  ExportCameras cameras_;
  ExportScene scene_;
  std::map<KeyframeId, std::uint32_t> first_view_;
};

/// The mean of what the images show of each point.
void color_points(const KeyframeImages& images, ExportScene& scene) {
  std::vector<Eigen::Vector4i> sums(scene.points.size(), Eigen::Vector4i::Zero());
  for (const ExportView& view : scene.views) {
    const auto found = images.find(view.keyframe);
    if (found == images.end() || view.rig_camera > 0) continue;
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
    const Rigid3 cam_from_world = keyframe.rig().cameras[0].cam_from_rig * keyframe.rig_from_world;
    poses.push_back({keyframe.timestamp_ns, cam_from_world.inverse()});
  });
  std::stable_sort(poses.begin(), poses.end(), [](const StampedPose& a, const StampedPose& b) {
    return a.timestamp_ns < b.timestamp_ns;
  });
  return poses;
}

ExportScene make_export_scene(const Map& map,
                              SubmapId submap,
                              const KeyframeImages& images,
                              ExportCameras cameras) {
  ExportScene scene = SceneBuilder(map, submap, cameras).build();
  color_points(images, scene);
  return scene;
}

}  // namespace waymark

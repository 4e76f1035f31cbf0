// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/export_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/image/opencv_image.h"

namespace waymark {
namespace {

/// A keyframe that a trajectory has, too.
struct Anchor {
  FramePlace place;
  Rigid3 world_from_camera;  ///< As the trajectory says.
};

std::vector<Anchor> find_anchors(const std::vector<FramePlace>& keyframes,
                                 std::span<const StampedPose> trajectory) {
  std::vector<Anchor> anchors;
  for (const FramePlace& keyframe : keyframes) {
    const auto found = std::ranges::lower_bound(
        trajectory, keyframe.timestamp_ns - kSameTimeNs, {}, &StampedPose::timestamp_ns);
    if (found == trajectory.end() || found->timestamp_ns > keyframe.timestamp_ns + kSameTimeNs) {
      continue;
    }
    anchors.push_back({keyframe, found->world_from_camera});
  }
  return anchors;
}

/// How the frame of one pose lies to that of another, lengths times a scale.
Rigid3 scaled_step(const Rigid3& world_from_a, const Rigid3& world_from_b, double scale) {
  Rigid3 a_from_b = world_from_a.inverse() * world_from_b;
  a_from_b.translation *= scale;
  return a_from_b;
}

/// Lengths of the map by those of the trajectory; 1 where nothing moves.
double relative_scale(const std::vector<Anchor>& anchors) {
  double in_map = 0.0, in_trajectory = 0.0;
  for (std::size_t i = 1; i < anchors.size(); ++i) {
    in_map += (anchors[i].place.rig_from_world.origin_in_source() -
               anchors[i - 1].place.rig_from_world.origin_in_source())
                  .norm();
    in_trajectory +=
        (anchors[i].world_from_camera.translation - anchors[i - 1].world_from_camera.translation)
            .norm();
  }
  const bool moves = in_map > 0.0 && in_trajectory > 0.0;
  return moves ? in_map / in_trajectory : 1.0;
}

/// Half of the steps from keyframe to keyframe must be those of the map, about: closing a loop
/// later changes a few of them, another recording all.
void expect_same_way(const std::vector<Anchor>& anchors, double scale, const std::string& name) {
  constexpr double kMaxTurnRad = 3.0 * std::numbers::pi / 180.0;
  constexpr double kMaxShare = 0.2;
  std::size_t num_same = 0;
  for (std::size_t i = 1; i < anchors.size(); ++i) {
    const Rigid3 told =
        scaled_step(anchors[i - 1].world_from_camera, anchors[i].world_from_camera, scale);
    const Rigid3 mapped =
        anchors[i - 1].place.rig_from_world * anchors[i].place.rig_from_world.inverse();
    const double off = (told.translation - mapped.translation).norm();
    num_same += told.rotation.angularDistance(mapped.rotation) < kMaxTurnRad &&
                off <= kMaxShare * mapped.translation.norm() + 1e-6 * scale;
  }
  if (2 * num_same + 1 >= anchors.size()) return;
  throw InputError(name,
                   "has the keyframes of the map in other places, expected the trajectory of the "
                   "run that made it");
}

/// How far the camera went between two frames, as the images show it.
double seen_step(const FramePlace& a, const FramePlace& b, double scene_distance) {
  const Rigid3 step = a.rig_from_world * b.rig_from_world.inverse();
  return Eigen::AngleAxisd(step.rotation).angle() + step.translation.norm() / scene_distance;
}

std::vector<std::size_t> choose_sharpest(std::span<const FramePlace> places,
                                         std::size_t number,
                                         double scene_distance) {
  std::vector<double> way(places.size(), 0.0);
  for (std::size_t i = 1; i < places.size(); ++i) {
    way[i] = way[i - 1] + seen_step(places[i - 1], places[i], scene_distance);
  }
  if (way.empty() || way.back() <= 0.0) {  // Nothing moves: parts of the time.
    for (std::size_t i = 0; i < way.size(); ++i) way[i] = static_cast<double>(i);
  }
  const double parts_per_way = static_cast<double>(number) / std::max(1e-300, way.back());
  std::map<std::size_t, std::size_t> best;  // By part of the way.
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto part = std::min(number - 1, static_cast<std::size_t>(way[i] * parts_per_way));
    const auto [found, is_first] = best.try_emplace(part, i);
    if (!is_first && places[i].sharpness > places[found->second].sharpness) found->second = i;
  }
  std::vector<std::size_t> chosen;
  for (const auto& [part, frame] : best) chosen.push_back(frame);
  return chosen;
}

/// What a camera saw at the moment of a frame that is no keyframe, near one that is.
ExportView empty_view(const ExportView& nearest, const RigCamera& camera, const FramePlace& place) {
  ExportView view;
  view.timestamp_ns = place.timestamp_ns;
  view.rig_camera = nearest.rig_camera;
  view.camera = nearest.camera;
  view.cam_from_world = camera.cam_from_rig * place.rig_from_world;
  return view;
}

}  // namespace

std::vector<FramePlace> keyframe_places(const Map& map, SubmapId submap) {
  std::vector<FramePlace> places;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (keyframe.submap == submap) {
      places.push_back({keyframe.timestamp_ns, keyframe.rig_from_world, id});
    }
  });
  std::ranges::stable_sort(places, {}, &FramePlace::timestamp_ns);
  return places;
}

std::vector<FramePlace> place_frames(const Map& map,
                                     SubmapId submap,
                                     std::span<const StampedPose> trajectory,
                                     const std::string& name) {
  const std::vector<Anchor> anchors = find_anchors(keyframe_places(map, submap), trajectory);
  if (anchors.empty()) return {};
  const double scale = relative_scale(anchors);
  expect_same_way(anchors, scale, name);
  std::vector<FramePlace> places;
  auto anchor = anchors.begin();
  for (const StampedPose& pose : trajectory) {
    const auto distance = [&](const Anchor& other) {
      return std::abs(other.place.timestamp_ns - pose.timestamp_ns);
    };
    while (anchor + 1 != anchors.end() && distance(*(anchor + 1)) < distance(*anchor)) ++anchor;
    FramePlace place = anchor->place;
    if (distance(*anchor) > kSameTimeNs) {
      place.timestamp_ns = pose.timestamp_ns;
      place.rig_from_world = scaled_step(pose.world_from_camera, anchor->world_from_camera, scale) *
                             anchor->place.rig_from_world;
    }
    places.push_back(place);
  }
  return places;
}

double sharpness(ImageView image) {
  cv::Mat laplacian;
  cv::Laplacian(mat_of(image), laplacian, CV_16S);
  cv::Scalar mean, deviation;
  cv::meanStdDev(laplacian, mean, deviation);
  return deviation[0] * deviation[0];
}

std::vector<std::size_t> choose_frames(std::span<const FramePlace> places,
                                       const ExportedFrames& selection,
                                       double scene_distance) {
  WAYMARK_CHECK(selection.number > 0);
  if (selection.choice == FrameChoice::kSharpest) {
    return choose_sharpest(places, selection.number, scene_distance);
  }
  const std::size_t step = selection.choice == FrameChoice::kEvery ? selection.number : 1;
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < places.size(); i += step) chosen.push_back(i);
  return chosen;
}

double median_distance(const ExportScene& scene) {
  std::vector<double> distances;
  for (const ExportPoint& point : scene.points) {
    const ExportView& view = scene.views[point.observations.front().view];
    distances.push_back((view.cam_from_world * point.position_in_world).norm());
  }
  if (distances.empty()) return 1.0;
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::ranges::nth_element(distances, middle);
  return std::max(1e-9, *middle);
}

ExportScene with_frames(const ExportScene& scene,
                        const Map& map,
                        std::span<const FramePlace> places) {
  std::map<std::pair<KeyframeId, std::size_t>, const ExportView*> of_keyframes;
  for (const ExportView& view : scene.views) {
    of_keyframes[{view.keyframe, view.rig_camera}] = &view;
  }
  ExportScene result{scene.cameras, scene.cam_from_rig, {}, scene.points};
  for (ExportPoint& point : result.points) point.observations.clear();
  for (const FramePlace& place : places) {
    const std::vector<RigCamera>& cameras = map.keyframes().at(place.nearest).rig().cameras;
    for (std::size_t c = 0; c < std::min(cameras.size(), place.num_images); ++c) {
      const ExportView& nearest = *of_keyframes.at({place.nearest, c});
      const bool is_keyframe = nearest.timestamp_ns == place.timestamp_ns;
      ExportView view = is_keyframe ? nearest : empty_view(nearest, cameras[c], place);
      view.name = fmt::format("{}{:06}_{}.jpg",
                              cameras.size() > 1 ? fmt::format("cam{}/", c) : "",
                              place.index,
                              view.timestamp_ns);
      const auto number = static_cast<std::uint32_t>(result.views.size());
      for (std::uint32_t k = 0; k < view.points.size(); ++k) {
        if (view.points[k] != kNoPoint)
          result.points[view.points[k]].observations.push_back({number, k});
      }
      result.views.push_back(std::move(view));
    }
  }
  // COLMAP takes points that no view sees, but not those that a single one does.
  for (ExportPoint& point : result.points) {
    if (point.observations.size() != 1) continue;
    result.views[point.observations[0].view].points[point.observations[0].feature] = kNoPoint;
    point.observations.clear();
  }
  return result;
}

}  // namespace waymark

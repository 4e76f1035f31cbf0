// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/pose_check.h"

#include <algorithm>

#include "waymark/base/median.h"
#include "waymark/track/last_frame.h"
#include "waymark/track/local_map.h"

namespace waymark {
namespace {

/// Of the feature's level: what poses and landmarks that are right may be off by.
constexpr float kMaxErrorPx = 8.0f;

/// From where a feature is to where a point is seen, in pixels of the feature's level.
Eigen::Vector2f offset_px(const Measurement& measured, const Eigen::Vector3d& point_in_cam) {
  return measured.level_pixel_from_bearing *
         (point_in_cam.normalized().cast<float>() - measured.bearing);
}

}  // namespace

double distance_from(const Rigid3& other, const Map& map, const LocatedFrame& located) {
  const Rigid3& found = located.rig_from_world;
  const double way = (found.origin_in_source() - other.origin_in_source()).norm();
  return found.rotation.angularDistance(other.rotation) +
         way * median_inverse_range(map, found, located.landmarks);
}

double part_in_place(const Features& features,
                     const Map& map,
                     std::span<const LandmarkId> alike,
                     const Rigid3& rig_from_world) {
  const int num_alike = num_valid(alike);
  if (num_alike == 0) return 1.0;
  const Rigid3 cam_from_world = features.rig->cameras[0].cam_from_rig * rig_from_world;
  int num_in_place = 0;
  for (std::uint32_t i = 0; i < alike.size(); ++i) {
    if (!alike[i].is_valid()) continue;
    const Eigen::Vector3d point = cam_from_world * map.landmarks().at(alike[i]).position_in_world;
    num_in_place += offset_px(features.measurement(i), point).norm() < kMaxErrorPx;
  }
  return static_cast<double>(num_in_place) / num_alike;
}

Eigen::Vector2f median_offset_px(const Features& features,
                                 const Map& map,
                                 std::span<const LandmarkId> landmarks,
                                 const Rigid3& rig_from_world) {
  const Rigid3 cam_from_world = features.rig->cameras[0].cam_from_rig * rig_from_world;
  std::vector<float> along_x, along_y;
  for (std::uint32_t i = 0; i < features.num_corners(); ++i) {
    if (!landmarks[i].is_valid()) continue;
    const Eigen::Vector3d point =
        cam_from_world * map.landmarks().at(landmarks[i]).position_in_world;
    const Eigen::Vector2f off_px = offset_px(features.measurement(i), point);
    along_x.push_back(off_px.x());
    along_y.push_back(off_px.y());
  }
  if (along_x.empty()) return Eigen::Vector2f::Zero();
  return {median(along_x), median(along_y)};
}

void PoseCheck::begin(const std::optional<Rigid3>& predicted) {
  predicted_ = predicted;
  rejected_.clear();
  refusal_.reset();
}

bool PoseCheck::is_verified(const Features& features,
                            const Map& map,
                            const LocatedFrame& located,
                            FrameLocator& locator) {
  if (predicted_ && distance_from(*predicted_, map, located) < options_.max_surprise) return true;
  const auto is_same = [&](const Rigid3& other) {
    return distance_from(other, map, located) < options_.max_same_distance;
  };
  if (std::ranges::any_of(rejected_, is_same)) return true;
  const Keyframe& beside = map.keyframes().at(main_observer(map, located.landmarks));
  const std::vector<LandmarkId> alike = locator.find_alike(features, beside);
  const double part = part_in_place(features, map, alike, located.rig_from_world);
  if (part >= kMinPartInPlace) return true;
  rejected_.push_back(located.rig_from_world);
  refusal_ = {.reason = FrameReason::kNotVerified,
              .num_matches = located.num_matches,
              .num_inliers = located.num_inliers};
  return false;
}

}  // namespace waymark

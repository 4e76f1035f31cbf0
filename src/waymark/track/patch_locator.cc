// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/patch_locator.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>

#include "waymark/features/feature_geometry.h"
#include "waymark/features/pyramid.h"
#include "waymark/image/small_image.h"

namespace waymark {
namespace {

/// Landmarks of fewer keyframes have distances that are off by more. Errors of distances make a
/// motion look shorter (as errors of a regressor do), and what is triangulated along it comes out
/// nearer: in darkness the scale collapsed within a second. See docs/decisions/track.md.
constexpr std::size_t kMinObservers = 4;

/// Of features that are known as well as the pixels of an image's detail tell.
std::uint8_t level_of_detail(const Camera& camera) {
  const double scale = 1.0 / detail_factor(camera.width_px(), camera.height_px());
  std::uint8_t level = 0;
  while (level + 1 < Pyramid::kNumLevels && Pyramid::scale(level) < scale) ++level;
  return level;
}

}  // namespace

std::vector<std::uint32_t> well_known(const LandmarkSet& landmarks, const Map& map) {
  std::vector<std::uint32_t> indices;
  for (std::uint32_t i = 0; i < landmarks.size(); ++i) {
    if (num_observers(map.landmarks().at(landmarks.ids[i])) >= kMinObservers) indices.push_back(i);
  }
  return indices;
}

std::optional<PatchAlignment> PatchLocator::align(const LocatedPatches& before,
                                                  const LandmarkSet& around,
                                                  const std::vector<std::uint32_t>& well_known,
                                                  const Frame& frame,
                                                  const Rigid3& predicted) {
  if (!frame.image || frame.image->detail.values.empty() || before.image.detail.values.empty()) {
    return std::nullopt;
  }
  const Rigid3& cam_from_rig = frame.features->rig->cameras[0].cam_from_rig;
  const Rigid3 cam_from_world = cam_from_rig * before.rig_from_world;
  const Rigid3 initial_b_from_a = cam_from_rig * predicted * cam_from_world.inverse();
  points_in_cam_.clear();
  for (const Eigen::Vector3d& point : around.positions_in_world) {
    points_in_cam_.push_back(cam_from_world * point);
  }
  if (auto found = align_some(before, well_known, frame, initial_b_from_a)) return found;
  std::vector<std::uint32_t> all(around.size());
  std::iota(all.begin(), all.end(), 0u);
  return align_some(before, all, frame, initial_b_from_a);
}

std::optional<PatchAlignment> PatchLocator::align_some(const LocatedPatches& before,
                                                       const std::vector<std::uint32_t>& chosen,
                                                       const Frame& frame,
                                                       const Rigid3& initial_b_from_a) {
  chosen_points_.clear();
  for (const std::uint32_t i : chosen) chosen_points_.push_back(points_in_cam_[i]);
  PatchAlignment found = aligner_.align(frame.features->rig->cameras[0].camera,
                                        before.image.detail,
                                        chosen_points_,
                                        frame.image->detail,
                                        initial_b_from_a);
  if (!found.is_certain()) return std::nullopt;
  for (std::uint32_t& index : found.alike) index = chosen[index];
  return found;
}

LocatedFrame PatchLocator::pose_of(const Rig& rig,
                                   const LocatedPatches& before,
                                   const PatchAlignment& found) {
  const Rigid3& cam_from_rig = rig.cameras[0].cam_from_rig;
  const Rigid3 rig_from_cam = cam_from_rig.inverse();
  LocatedFrame located;
  located.rig_from_world = rig_from_cam * found.b_from_a * cam_from_rig * before.rig_from_world;
  const Matrix6d adjoint = rig_from_cam.adjoint();
  located.covariance = adjoint * found.covariance * adjoint.transpose();
  return located;
}

void PatchLocator::add_features(const PatchAlignment& found,
                                const LandmarkSet& around,
                                Frame& frame,
                                LocatedFrame& located) const {
  std::vector<LandmarkId> known = primary_landmarks(*frame.features, located.landmarks);
  std::ranges::sort(known);
  const Camera& camera = *frame.features->rig->cameras[0].camera;
  std::vector<Keypoint> keypoints;
  std::vector<Descriptor> descriptors;
  std::vector<LandmarkId> landmarks;
  for (const std::uint32_t i : found.alike) {
    if (std::ranges::binary_search(known, around.ids[i])) continue;
    const Eigen::Vector3d point = found.b_from_a * points_in_cam_[i];
    Eigen::Vector2d pixel;
    std::uint8_t is_visible = 0;
    camera.project({&point, 1}, {&pixel, 1}, {&is_visible, 1});
    if (!is_visible) continue;
    Keypoint keypoint;
    keypoint.x_px = static_cast<float>(pixel.x());
    keypoint.y_px = static_cast<float>(pixel.y());
    keypoint.level = level_of_detail(camera);
    keypoints.push_back(keypoint);
    descriptors.push_back(around.descriptors[i]);
    landmarks.push_back(around.ids[i]);
  }
  const auto at = static_cast<std::ptrdiff_t>(frame.features->num_corners());
  located.landmarks.insert(located.landmarks.begin() + at, landmarks.begin(), landmarks.end());
  frame.features =
      std::make_shared<const Features>(with_points(*frame.features, keypoints, descriptors));
  located.num_matches = located.num_inliers = num_valid(located.landmarks);
}

}  // namespace waymark

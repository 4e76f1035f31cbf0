// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/keyframe_decision.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "waymark/base/median.h"
#include "waymark/camera/pixel_angles.h"
#include "waymark/features/range_precision.h"

namespace waymark {

KeyframeView view_of(const Keyframe& keyframe) {
  return view_of(*keyframe.features, keyframe.landmarks, keyframe.rig_from_world);
}

KeyframeView view_of(const Features& features,
                     std::span<const LandmarkId> landmarks,
                     const Rigid3& rig_from_world) {
  KeyframeView view{{}, rig_from_world.origin_in_source()};
  for (const LandmarkId id : landmarks.first(features.num_primary)) {
    if (id.is_valid()) view.landmarks.push_back(id);
  }
  return view;
}

KeyframeSituation compare_with_reference(const Features& features,
                                         bool has_range,
                                         const LocatedFrame& located,
                                         const Map& map,
                                         const KeyframeView& reference,
                                         std::size_t submap_age,
                                         const KeyframeOptions& options) {
  const std::size_t enough =
      std::min(static_cast<std::size_t>(options.established_observers), submap_age);
  std::vector<LandmarkId> established;
  for (const LandmarkId seen : reference.landmarks) {
    const LandmarkId id = map.resolve(seen);
    if (id.is_valid() && num_observers(map.landmarks().at(id)) >= enough) established.push_back(id);
  }
  std::ranges::sort(established);
  KeyframeSituation situation;
  situation.has_range = has_range;
  situation.num_reference = static_cast<int>(established.size());
  const Eigen::Vector3d centre = located.rig_from_world.origin_in_source();
  const double pixel_rad = central_pixel_angle(*features.rig->cameras[0].camera);
  std::vector<double> parallaxes_px;
  for (std::uint32_t i = 0; i < features.num_primary; ++i) {
    const LandmarkId id = located.landmarks[i];
    const bool is_near = has_range && has_reliable_range(features, i);
    situation.num_near_tracked += is_near && id.is_valid();
    situation.num_near_untracked += is_near && !id.is_valid();
    if (!id.is_valid()) continue;
    situation.num_shared += std::ranges::binary_search(established, id);
    const Eigen::Vector3d& point = map.landmarks().at(id).position_in_world;
    const Eigen::Vector3d a = (point - centre).normalized();
    const Eigen::Vector3d b = (point - reference.centre).normalized();
    parallaxes_px.push_back((a - b).norm() / pixel_rad);
  }
  if (!parallaxes_px.empty()) situation.median_parallax_px = median(parallaxes_px);
  return situation;
}

bool should_make_keyframe(const KeyframeSituation& situation, const TrackingSettings& settings) {
  const KeyframeOptions& options = settings.options.keyframes;
  if (situation.num_pending >= static_cast<std::size_t>(options.max_pending) ||
      situation.frames_since_keyframe < 1)
    return false;
  const bool sees_little = situation.num_shared < settings.keyframe_ratio * situation.num_reference;
  const bool has_parallax = situation.median_parallax_px > settings.keyframe_parallax_px;
  const bool is_overdue =
      situation.frames_since_keyframe >= settings.max_keyframe_interval &&
      situation.median_parallax_px > options.overdue_parallax * settings.keyframe_parallax_px;
  const int num_near = situation.num_near_tracked + situation.num_near_untracked;
  // A keyframe on its way makes landmarks of what is near.
  const bool sees_new = situation.has_range && situation.num_pending == 0 &&
                        situation.num_near_tracked < options.min_known_near * num_near;
  return sees_little || has_parallax || is_overdue || sees_new;
}

}  // namespace waymark

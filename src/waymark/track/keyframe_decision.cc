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
KeyframeSituation compare_with_reference(const Features& features,
                                         bool has_range,
                                         const LocatedFrame& located,
                                         const Map& map,
                                         KeyframeId reference_id,
                                         std::size_t submap_age,
                                         const KeyframeOptions& options) {
  const Keyframe& reference = map.keyframes().at(reference_id);
  const std::size_t established =
      std::min(static_cast<std::size_t>(options.established_observers), submap_age);
  KeyframeSituation situation;
  situation.has_range = has_range;
  for (std::uint32_t i = 0; i < reference.features->num_primary; ++i) {
    const Landmark* landmark = map.landmarks().find(reference.landmarks[i]);
    situation.num_reference += landmark && num_observers(*landmark) >= established;
  }
  const Eigen::Vector3d centre = located.rig_from_world.origin_in_source();
  const Eigen::Vector3d reference_centre = reference.rig_from_world.origin_in_source();
  const double pixel_rad = central_pixel_angle(*features.rig->cameras[0].camera);
  std::vector<double> parallaxes_px;
  for (std::uint32_t i = 0; i < features.num_primary; ++i) {
    const LandmarkId id = located.landmarks[i];
    const bool is_near = has_range && has_reliable_range(features, i);
    situation.num_near_tracked += is_near && id.is_valid();
    situation.num_near_untracked += is_near && !id.is_valid();
    if (!id.is_valid()) continue;
    const Landmark& landmark = map.landmarks().at(id);
    situation.num_shared +=
        num_observers(landmark) >= established && is_observed_by(landmark, reference_id);
    const Eigen::Vector3d& point = landmark.position_in_world;
    const Eigen::Vector3d a = (point - centre).normalized();
    const Eigen::Vector3d b = (point - reference_centre).normalized();
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
  const bool sees_new =
      situation.has_range && situation.num_near_tracked < options.min_known_near * num_near;
  return sees_little || has_parallax || is_overdue || sees_new;
}

}  // namespace waymark

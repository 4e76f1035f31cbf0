// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/map_difference.h"

namespace waymark {
namespace {

bool is_same(const Rigid3& a, const Rigid3& b) {
  return a.rotation.coeffs() == b.rotation.coeffs() && a.translation == b.translation;
}

/// Whether what a file holds of a keyframe beside its features is the same.
bool has_same_state(const Keyframe& a, const Keyframe& b) {
  return a.submap == b.submap && a.parent == b.parent &&
         is_same(a.rig_from_world, b.rig_from_world) && a.applied_scale == b.applied_scale &&
         a.landmarks == b.landmarks;
}

bool is_same(const Appearance& a, const Appearance& b) {
  return a.descriptor == b.descriptor && a.direction == b.direction && a.size_m == b.size_m &&
         a.across == b.across;
}

/// Whether what a file holds of a landmark is the same.
bool is_same(const Landmark& a, const Landmark& b) {
  return a.submap == b.submap && a.position_in_world == b.position_in_world &&
         a.reference == b.reference && a.num_visible == b.num_visible &&
         a.num_found == b.num_found && is_same(a.appearance, b.appearance);
}

}  // namespace

std::optional<MapDifference> find_difference(const Map& before, const Map& now) {
  MapDifference difference;
  bool is_later = now.keyframes().end_id() >= before.keyframes().end_id() &&
                  now.landmarks().end_id() >= before.landmarks().end_id();
  const auto compare_keyframes = [&](KeyframeId id, const Keyframe* old, const Keyframe* current) {
    if (!current) {
      difference.erased.push_back(id);
      is_later &= now.keyframe_forwarding().contains(id);
      return;
    }
    is_later &= old || id >= before.keyframes().end_id();
    if (!old || old->features != current->features || old->markers != current->markers ||
        old->frame != current->frame || old->timestamp_ns != current->timestamp_ns) {
      difference.measured.push_back(id);
    } else if (!has_same_state(*old, *current)) {
      difference.changed.push_back(id);
    }
  };
  now.keyframes().for_each_difference(before.keyframes(), compare_keyframes);
  const auto compare_landmarks = [&](LandmarkId id, const Landmark* old, const Landmark* current) {
    if (!current) {
      difference.erased_landmarks.push_back(id);
    } else if (!old || !is_same(*old, *current)) {
      is_later &= old || id >= before.landmarks().end_id();
      difference.landmarks.push_back(id);
    }
  };
  now.landmarks().for_each_difference(before.landmarks(), compare_landmarks);
  const auto compare_odometry =
      [&](KeyframeId id, const OdometryNode* old, const OdometryNode* current) {
        if (old && current) return;
        is_later &= current && id >= before.odometry().end_id();
        difference.noted.push_back(id);
      };
  now.odometry().for_each_difference(before.odometry(), compare_odometry);
  if (!is_later) return std::nullopt;
  // Keyframes that came and went in between have nothing but their heir.
  now.keyframe_forwarding().for_each_difference(
      before.keyframe_forwarding(),
      [&](KeyframeId id, const KeyframeForwarding* old, const KeyframeForwarding*) {
        if (!old && id >= before.keyframes().end_id()) difference.erased.push_back(id);
      });
  return difference;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/keyframe_decision.h"

namespace waymark {
namespace {

/// Sent keyframes that may be outstanding before the tracker holds back.
constexpr std::size_t kMaxPending = 2;
/// Where less than this part of the features with a reliable range have a landmark, most of what
/// the camera sees is new.
constexpr double kMinKnownNear = 0.3;

}  // namespace

bool should_make_keyframe(const KeyframeSituation& situation, const TrackingSettings& settings) {
  if (situation.num_pending >= kMaxPending || situation.frames_since_keyframe < 1) return false;
  const bool sees_little = situation.num_shared < settings.keyframe_ratio * situation.num_reference;
  const bool has_parallax = situation.median_parallax_px > settings.keyframe_parallax_px;
  const bool is_overdue = situation.frames_since_keyframe >= settings.max_keyframe_interval &&
                          situation.median_parallax_px > 0.25 * settings.keyframe_parallax_px;
  const int num_near = situation.num_near_tracked + situation.num_near_untracked;
  const bool sees_new =
      situation.has_range && situation.num_near_tracked < kMinKnownNear * num_near;
  return sees_little || has_parallax || is_overdue || sees_new;
}

}  // namespace waymark

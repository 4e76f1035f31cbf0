// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/keyframe_decision.h"

namespace waymark {
namespace {

/// Sent keyframes that may be outstanding before the tracker holds back.
constexpr std::size_t kMaxPending = 2;
/// A camera that has moved this far against the scene gives new depth information.
constexpr double kParallaxPx = 20.0;
/// With fewer near landmarks than this, translation is weak; new ones are wanted if there are any.
constexpr int kFewNear = 100;
constexpr int kManyNew = 70;

}  // namespace

bool should_make_keyframe(const KeyframeSituation& situation, const TrackingSettings& settings) {
  if (situation.num_pending >= kMaxPending || situation.frames_since_keyframe < 1) return false;
  const bool sees_little =
      situation.num_inliers < settings.keyframe_ratio * situation.num_reference;
  const bool has_parallax = situation.median_motion_px > kParallaxPx;
  const bool is_overdue = situation.frames_since_keyframe >= settings.max_keyframe_interval &&
                          situation.median_motion_px > 0.25 * kParallaxPx;
  const bool lacks_near = situation.has_range && situation.num_near_tracked < kFewNear &&
                          situation.num_near_untracked > kManyNew;
  return sees_little || has_parallax || is_overdue || lacks_near;
}

}  // namespace waymark
